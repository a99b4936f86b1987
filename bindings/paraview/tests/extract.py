"""Run by pvbatch, on any number of ranks: extracts surfaces and writes the arrays of all ranks together to a file of NumPy.

usage: extract.py PLUGIN SOURCE OUTPUT PROPERTIES, where PROPERTIES is JSON and SOURCE is 'wavelet' or a file.
"""

import json
import sys

import numpy as np
from paraview import servermanager, simple
from vtkmodules.util.numpy_support import vtk_to_numpy

plugin, source_name, output, properties = sys.argv[1:]
simple.LoadPlugin(plugin, remote=False, ns=globals())
if source_name == "wavelet":
    source = simple.Wavelet(WholeExtent=[-10, 13, -9, 12, -7, 8])
else:
    source = simple.OpenDataFile(source_name)
source.UpdatePipeline()  # so that its first array is the one to contour by
surface = MarrowContour(Input=source, **json.loads(properties))  # noqa: F821, a name that the plugin defines
surface.UpdatePipeline()
data = servermanager.Fetch(surface)


def array(values):
    return np.empty(0) if values is None else vtk_to_numpy(values)


point_data = data.GetPointData()
np.savez(
    output,
    points=array(data.GetPoints() and data.GetPoints().GetData()),
    triangles=array(data.GetPolys().GetConnectivityArray()).reshape(-1, 3),
    normals=array(point_data.GetNormals()),
    scalars=array(point_data.GetScalars()),
    ids=array(point_data.GetGlobalIds()),
    names=[point_data.GetArrayName(n) for n in range(point_data.GetNumberOfArrays())],
)
