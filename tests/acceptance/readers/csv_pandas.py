"""CSV by pandas: the tables as they come, without a word about their form."""

import pandas
from read_files import tell


def read(path):
    table = pandas.read_csv(path)
    columns = {name: table[name].tolist() for name in table.columns}
    for name, values in columns.items():
        columns[name] = [None if value != value else value for value in values]
    return {"columns": columns, "kinds": {name: table[name].dtype.kind for name in table.columns}, "rows": len(table)}


tell("pandas", pandas.__version__, read)
