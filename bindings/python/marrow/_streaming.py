"""Surfaces of volumes that do not fit in memory."""

from __future__ import annotations

import os
import re
from typing import Any, NamedTuple, Optional, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _marrow
from ._arrays import Array, as_number, as_samples_of, sample_dtype
from ._as_volume import as_slices
from ._marrow import InputError
from ._mesh import FileSpace
from ._scan import Path, Progress
from ._volume import Geometry, Spacing, Volume, distances


class SurfaceSize(NamedTuple):
    """The size of a surface that was written.

    Attributes
    ----------
    points, triangles : int
        Their numbers.
    """

    points: int
    triangles: int


def extract_to_file(
    source: Any,
    isovalue: float,
    path: Path,
    *,
    max_memory: Union[int, str] = "1G",
    closed: bool = False,
    topology: bool = False,
    space: FileSpace = "LPS",
    spacing: Optional[Spacing] = None,
    origin: Optional[ArrayLike] = None,
    direction: Optional[ArrayLike] = None,
    affine: Optional[ArrayLike] = None,
    threads: int = 0,
    progress: Optional[Progress] = None,
) -> SurfaceSize:
    """Extract a surface of any size to a file, with only a part of the volume and of the surface in memory.

    The volume is read twice, slice by slice. For an array in C order, the file has the same bytes as
    ``extract(...).write(path)``. For another order in memory, that gives the same points in another order, and may cut
    polygons into other triangles.

    Parameters
    ----------
    source : path-like, Volume, or array-like, shape (nz, ny, nx)
        A Zarr folder; an uncompressed NIfTI, NRRD or MetaImage file; or anything with ``shape``, ``dtype`` and
        ``[z0:z1]``, such as arrays of Zarr, h5py, Dask, or numpy.memmap. Its slices are asked for on the calling
        thread, in whole chunks where it has them. Images as for `as_volume`, but for nibabel's: an xarray.DataArray
        is loaded as a whole, unless it has chunks of Dask.
    isovalue : float
        In the unit of the values.
    path : path-like
        The output: .stl or .ply.
    max_memory : int or str
        Bytes that all arrays of Marrow together may take, at most 10^18; '800M' and '4G' are multiples of 2^20 and
        2^30. What `source` takes to give its slices comes on top.
    closed, topology, threads, progress
        As for `extract`.
    space : {'LPS', 'RAS', 'none'}
        The space of the file's coordinates, as for `Mesh.write`.
    spacing, origin, direction, affine
        As for Volume. A Volume and an image have their own. So has a path, but for `spacing` if it does not state it.

    Returns
    -------
    SurfaceSize
        The numbers of points and triangles.

    Raises
    ------
    EmptySurface
        All samples are on one side of the isovalue, or an open surface has a single sample along an axis. There is no
        file then, nor after another error.
    InputError
        `source` cannot be sliced, has not three axes or slices of its dtype, or must be read as a whole; the format
        of the output cannot be written in parts.
    LimitError
        `max_memory` is too little, or there are more than 2^32 - 1 points.
    IoError, Cancelled
        As `read` and `Mesh.write`. Exceptions of `source` arrive as they are.
    """
    isovalue = as_number(isovalue, "the isovalue")
    options: dict[str, Any] = {
        "max_memory": _bytes(max_memory),
        "closed": closed,
        "topology": topology,
        "space": space,
        "threads": threads,
        "progress": progress,
    }
    place: dict[str, Any] = {"spacing": spacing, "origin": origin, "direction": direction, "affine": affine}
    if isinstance(source, (str, os.PathLike)):
        given = spacing_of_path(**place)
        return SurfaceSize(*_marrow.extract_file_to_file(source, isovalue, path, spacing=given, **options))

    array: Any
    geometry: Union[Volume, Geometry]
    if isinstance(source, Volume):  # whose samples take less memory than its values
        if any(value is not None for value in place.values()):
            raise InputError("a Volume has its own spacing, origin and direction: do not give others")
        array, geometry, rescale = source.samples, source, source.rescale
    else:
        (array, geometry), rescale = as_slices(source, **place), (1.0, 0.0)

    dtype = sample_dtype(np.dtype(array.dtype))

    def read(first: int, last: int) -> Array:
        shape = (last - first, *array.shape[1:])
        return as_samples_of(array[first:last], shape, dtype, f"the part [{first}:{last}] of the array")

    size = _marrow.extract_slices_to_file(
        read,
        array.shape,
        dtype,
        _slices_at_once(array),
        geometry.spacing,
        geometry.origin,
        geometry.direction,
        rescale,
        isovalue,
        path,
        **options,
    )
    return SurfaceSize(*size)


def _slices_at_once(array: Any) -> int:
    """Return the slices that the chunks of h5py's and Zarr's arrays hold; Dask's may differ in size."""
    chunks = getattr(array, "chunks", None)
    return int(chunks[0]) if chunks and isinstance(chunks[0], (int, np.integer)) else 1


def spacing_of_path(spacing: Optional[Spacing] = None, **others: Optional[ArrayLike]) -> Optional[NDArray[np.float64]]:
    """Return the spacing that is given for a path, which has its own origin and direction."""
    if any(value is not None for value in others.values()):
        raise InputError("a path has its own origin and direction: do not give others")
    return None if spacing is None else distances(spacing)


def _bytes(size: Union[int, str]) -> int:
    units = {"": 1, "K": 2**10, "M": 2**20, "G": 2**30, "T": 2**40}
    match = re.fullmatch(r"(\d+(?:\.\d+)?)([KMGT]?)", str(size).strip(), re.IGNORECASE)
    size_in_bytes = float(match[1]) * units[match[2].upper()] if match else 0
    if not 1 <= size_in_bytes <= 1e18:
        raise InputError(f"max_memory is a size such as 800000, '800M' or '4G', at most 10^18 bytes, not {size!r}")
    return int(size_in_bytes)
