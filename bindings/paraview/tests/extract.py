"""Run by pvbatch, on any number of ranks: extracts surfaces and writes the arrays of all ranks together to files of NumPy.

usage: extract.py PLUGIN JOBS, where JOBS is JSON: a list of [source, filter, properties, output]. A source is 'wavelet' or a
file.
"""

import json
import sys

import numpy as np
from paraview import servermanager, simple
from vtkmodules.util.numpy_support import vtk_to_numpy


def values_of(array):
    return np.empty(0) if array is None else vtk_to_numpy(array)


def run(source_name, filter_name, properties, output):
    if source_name == "wavelet":
        source = simple.Wavelet(WholeExtent=[-10, 13, -9, 12, -7, 8])
    else:
        source = simple.OpenDataFile(source_name)
    source.UpdatePipeline()  # so that the filter finds its first array
    surface = globals().get(filter_name, getattr(simple, filter_name, None))(Input=source, **properties)
    surface.UpdatePipeline()
    data = servermanager.Fetch(surface)  # of all ranks
    point_data = data.GetPointData()
    np.savez(
        output,
        points=values_of(data.GetPoints() and data.GetPoints().GetData()),
        triangles=values_of(data.GetPolys().GetConnectivityArray()).reshape(-1, 3),
        normals=values_of(point_data.GetNormals()),
        scalars=values_of(point_data.GetScalars()),
        ids=values_of(point_data.GetGlobalIds()),
    )


simple.LoadPlugin(sys.argv[1], remote=False, ns=globals())
for job in json.loads(sys.argv[2]):
    run(*job)
