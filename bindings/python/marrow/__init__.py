"""Isosurfaces from CT and MRI scans by marching cubes with histogram pyramids.

>>> import marrow
>>> scan = marrow.read("head.nii.gz")
>>> skull = marrow.extract(scan, "bone", closed=True)
>>> skull.write("skull.stl")

Arrays are indexed [k, j, i], that is z, y, x. Positions are (x, y, z) in millimetres, in LPS: x to the patient's
left, y to posterior, z to superior.
"""

from ._as_volume import as_volume
from ._devices import Device, devices
from ._filters import crop, gaussian_filter, median_filter, resample_isotropic
from ._histogram import Histogram, Sweep, find_plateaus, histogram, otsu, sweep
from ._isosurface import TISSUE_PRESETS, IsosurfaceExtractor, TissuePreset, extract
from ._label_table import LabelEntry, read_label_table
from ._labels import count_labels, labels
from ._marrow import (
    Cancelled,
    DeviceError,
    EmptySurface,
    Error,
    GeometryError,
    InputError,
    IoError,
    LimitError,
    __version__,
)
from ._measures import Distance, MeshCheck, MeshMeasures, Roughness, TriangleQuality
from ._mesh import Mesh, read_mesh, write_meshes
from ._scan import ScanInfo, ScanReport, SeriesInfo, SeriesReport, inspect, read
from ._skimage import MarchingCubes, marching_cubes
from ._streaming import SurfaceSize, extract_to_file
from ._thin_walls import ThinWalls, find_thin_walls
from ._trust import Noise, Trust, TrustPercentiles
from ._volume import Volume

__all__ = [
    "TISSUE_PRESETS",
    "Cancelled",
    "Device",
    "DeviceError",
    "Distance",
    "EmptySurface",
    "Error",
    "GeometryError",
    "Histogram",
    "InputError",
    "IoError",
    "IsosurfaceExtractor",
    "LabelEntry",
    "LimitError",
    "MarchingCubes",
    "Mesh",
    "MeshCheck",
    "MeshMeasures",
    "Noise",
    "Roughness",
    "ScanInfo",
    "ScanReport",
    "SeriesInfo",
    "SeriesReport",
    "SurfaceSize",
    "Sweep",
    "ThinWalls",
    "TissuePreset",
    "TriangleQuality",
    "Trust",
    "TrustPercentiles",
    "Volume",
    "as_volume",
    "count_labels",
    "crop",
    "devices",
    "extract",
    "extract_to_file",
    "find_plateaus",
    "find_thin_walls",
    "gaussian_filter",
    "histogram",
    "inspect",
    "labels",
    "marching_cubes",
    "median_filter",
    "otsu",
    "read",
    "read_label_table",
    "read_mesh",
    "resample_isotropic",
    "sweep",
    "write_meshes",
]
