"""TRC by OpenSim: as the table that scripts load, and as the reference that inverse kinematics follows."""

import opensim
from opensim_table import rows_of
from read_files import tell


def read(path):
    table = opensim.TimeSeriesTableVec3(path)
    weights = opensim.SetMarkerWeights()
    reference = opensim.MarkersReference(path, weights)
    names = reference.getNames()
    return {
        "labels": list(table.getColumnLabels()),
        "points": rows_of(table),
        "times_s": list(table.getIndependentColumn()),
        "unit": table.getTableMetaDataString("Units"),
        "rate_hz": float(table.getTableMetaDataString("DataRate")),
        "frames": int(table.getNumRows()),
        "reference_labels": [names.getElt(i) for i in range(names.size())],
        "reference_frames": int(reference.getNumFrames()),
        "reference_rate_hz": float(reference.getSamplingFrequency()),
    }


opensim.Logger.setLevelString("off")
tell("OpenSim", opensim.GetVersion().partition("-")[0], read)
