"""A table of OpenSim as lists."""


def rows_of(table):
    """[frame][marker] of x, y, z."""
    n = table.getNumColumns()
    rows = []
    for i in range(table.getNumRows()):
        row = table.getRowAtIndex(i)
        rows.append([[value[0], value[1], value[2]] for value in (row.getElt(0, j) for j in range(n))])
    return rows
