"""Isosurfaces of volumes."""

from __future__ import annotations

from typing import Any, Callable, Union

from . import _marrow
from ._mesh import Mesh
from ._volume import Volume

Progress = Callable[[float], Any]


def extract(
    volume: Any,
    isovalue: Union[float, str],
    *,
    closed: bool = False,
    normals: bool = True,
    snap: float = 0.0,
    threads: int = 0,
    progress: Union[Progress, None] = None,
) -> Mesh:
    """Extract the surface where samples reach an isovalue."""
    if not isinstance(volume, Volume):
        volume = Volume(volume)
    return Mesh._of(
        _marrow.extract(
            volume._native(), isovalue, closed=closed, normals=normals, snap=snap, threads=threads, progress=progress
        )
    )
