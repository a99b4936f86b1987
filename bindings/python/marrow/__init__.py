"""Isosurfaces from CT and MRI scans by marching cubes with histogram pyramids."""

from ._isosurface import extract
from ._marrow import (
    Cancelled,
    EmptySurface,
    Error,
    GeometryError,
    InputError,
    IoError,
    LimitError,
    __version__,
)
from ._mesh import Mesh
from ._skimage import MarchingCubes, marching_cubes
from ._volume import Volume

__all__ = [
    "Cancelled",
    "EmptySurface",
    "Error",
    "GeometryError",
    "InputError",
    "IoError",
    "LimitError",
    "MarchingCubes",
    "Mesh",
    "Volume",
    "extract",
    "marching_cubes",
]
