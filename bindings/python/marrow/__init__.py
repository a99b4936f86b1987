"""Isosurfaces from CT and MRI scans by marching cubes with histogram pyramids."""

from ._marrow import (
    Cancelled,
    Error,
    GeometryError,
    InputError,
    IoError,
    LimitError,
    __version__,
)

__all__ = ["Cancelled", "Error", "GeometryError", "InputError", "IoError", "LimitError"]
