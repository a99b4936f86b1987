"""The marching cubes of scikit-image, by Marrow."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, Optional

import numpy as np

from . import _marrow
from ._arrays import as_array, as_number, as_samples, refuse_path
from ._marrow import EmptySurface, InputError, LimitError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from ._scan import Progress

# The triangles of a mask's cells are found by their centres, which are float32.
_MOST_MASKED = 4096


class MarchingCubes(NamedTuple):
    """What :func:`marching_cubes` returns: C-contiguous arrays that may be changed.

    Attributes
    ----------
    verts : ndarray of float32, shape (V, 3)
        The points in the order of the array's axes, times `spacing`.
    faces : ndarray of int32, shape (F, 3)
        The indices of each triangle's points.
    normals : ndarray of float32, shape (V, 3)
        One unit vector per point, down the gradient.
    values : ndarray of float32, shape (V,)
        The range of the samples around each point.
    """

    verts: NDArray[np.float32]
    faces: NDArray[np.int32]
    normals: NDArray[np.float32]
    values: NDArray[np.float32]


def marching_cubes(
    volume: ArrayLike,
    level: float | None = None,
    *,
    spacing: Sequence[float] = (1.0, 1.0, 1.0),
    gradient_direction: Literal["descent", "ascent"] = "descent",
    step_size: int = 1,
    allow_degenerate: bool = True,
    method: Literal["lewiner", "lorensen"] = "lewiner",
    mask: ArrayLike | None = None,
    closed: bool = False,
    snap: float = 0.0,
    topology: bool = False,
    threads: int = 0,
    progress: Progress | None = None,
) -> MarchingCubes:
    """Extract an isosurface as `skimage.measure.marching_cubes` does, with its arguments and results.

    Parameters
    ----------
    volume : array_like, shape (M, N, P)
        The samples, at least 2 along each axis. They are copied only if their type is float16, uint32, int64 or
        uint64, if their bytes are in another order than the processor's, with `step_size`, or if some are infinite,
        which count as the largest and the smallest number of their type. NaN counts as outside.
    level : float, optional
        The isovalue: samples greater than `level` are inside. By default the mean of the lowest and the
        highest sample.
    spacing : sequence of 3 floats, optional
        The distances between samples along the array's axes.
    gradient_direction : {'descent', 'ascent'}, optional
        'descent' if the object is brighter than its surroundings. It decides only the winding of `faces`.
    step_size : int, optional
        Use each n-th sample along each axis, ``volume[::n, ::n, ::n]``, at its position.
    allow_degenerate : bool, optional
        Accepted for compatibility: the points of a face are always distinct.
    method : {'lewiner', 'lorensen'}, optional
        Accepted for compatibility: both name Marrow's own method, whose surface has no holes.
    mask : array_like of bool, shape (M, N, P), optional
        Only the cells whose eight samples are True in the mask have a surface, and count for `values`. It goes
        with neither `closed` nor `snap`.
    closed : bool, optional
        Close the surface at the border of the volume, as if outside samples surrounded it.
    snap : float, optional
        Merge points within this fraction of an edge of a sample, less than 0.5: fewer points, no slivers.
    topology : bool, optional
        Give the surface exactly the topology of the trilinear interpolant, as `extract` does. It does not go with
        `snap`. Points within a cell have the value of a cell beside them.
    threads : int, optional
        The number of threads; 0 stands for all.
    progress : callable, optional
        Is called with the fraction that is done, from 0 to 1. If it returns False, the work stops.

    Returns
    -------
    verts : ndarray of float32, shape (V, 3)
        The points, in the order of the array's axes, times `spacing`.
    faces : ndarray of int32, shape (F, 3)
        The indices of each triangle's points. With 'descent', they are clockwise as seen from outside if
        (axis 0, axis 1, axis 2) is taken as right-handed, as in scikit-image.
    normals : ndarray of float32, shape (V, 3)
        One unit vector per point, from high samples to low ones, at right angles to the surface also if the
        spacing differs between axes.
    values : ndarray of float32, shape (V,)
        The difference between the highest and the lowest sample of a cell, for the cell around the point in
        which it is largest.

    Raises
    ------
    InputError
        A ValueError: a bad argument, or a level outside the range of the samples.
    EmptySurface
        A RuntimeError, and an InputError: there is no surface, for example because the mask leaves no cell.
    Cancelled
        `progress` returned False.

    See Also
    --------
    extract : The same surface in the patient's space, for a volume with a position in it.

    Notes
    -----
    The differences from scikit-image are listed in docs/python.md.
    """
    if method not in ("lewiner", "lorensen"):
        raise InputError(f"method is 'lewiner' or 'lorensen', not {method!r}")
    if gradient_direction not in ("descent", "ascent"):
        raise InputError(f"gradient_direction is 'descent' or 'ascent', not {gradient_direction!r}")
    if not np.iterable(spacing) or len(list(spacing)) != 3:
        raise InputError(f"spacing is not 3 numbers: {spacing!r}")
    if int(step_size) < 1:
        raise InputError(f"step_size is {step_size}, and must be at least 1")
    array = _three_axes(volume)
    # A sample that equals the level is outside in scikit-image, and inside elsewhere in Marrow.
    isovalue = math.nextafter(_middle(array) if level is None else as_number(level, "level"), math.inf)
    steps = (slice(None, None, int(step_size)),) * 3
    if min(array[steps].shape) < 2:
        raise EmptySurface(f"step_size {step_size} leaves a single sample along an axis, and so no cell")
    distances = [_distance(distance, axis) * int(step_size) for axis, distance in enumerate(spacing)]
    inside = None if mask is None else _in_array_order(_mask(mask, array.shape, closed, snap)[steps], distances)

    def extract(samples: NDArray[Any], progress: Optional[Progress]) -> tuple[MarchingCubes, bool]:
        verts, faces, normals, values, all_finite = _marrow.marching_cubes(
            _in_array_order(samples[steps], distances),
            isovalue,
            mask=inside,
            inward=gradient_direction == "descent",
            closed=closed,
            snap=snap,
            topology=topology,
            threads=threads,
            progress=progress,
        )
        return MarchingCubes(verts, faces, normals, values), all_finite

    result, all_finite = extract(array, progress)
    if not all_finite and any(np.isinf(part).any() for part in array):
        result, _ = extract(_with_numbers_for_infinity(array), _at_end(progress) if progress else None)
    if len(result.verts) == 0:
        _raise_for_range(array, level)
        raise EmptySurface("there is no surface at this level")
    return result


def _at_end(progress: Progress) -> Progress:
    """Return a function that goes on to report 1, as the fraction of work that is done again must not go back."""
    return lambda fraction: progress(1.0)


def _three_axes(volume: ArrayLike) -> NDArray[Any]:
    refuse_path(volume)
    array = as_array(volume)
    if array.ndim != 3:
        raise InputError(f"a volume has three axes, and the array has {array.ndim}")
    if min(array.shape) < 2:
        raise InputError(f"a volume has at least 2 samples along each axis, and the shape is {array.shape}")
    return as_samples(array)


def _mask(mask: ArrayLike, shape: tuple[int, ...], closed: bool, snap: float) -> NDArray[Any]:
    if closed or snap:
        raise InputError("a mask goes with neither closed nor snap")
    array = as_array(mask).astype(bool, copy=False)
    if array.shape != shape:
        raise InputError(f"the mask has the shape {array.shape}, and the volume {shape}")
    if max(shape) > _MOST_MASKED:
        raise LimitError(f"a mask has at most {_MOST_MASKED} samples along an axis, and this one {max(shape)}")
    return array.view(np.uint8)


def _distance(value: Any, axis: int) -> float:
    distance = as_number(value, f"spacing along axis {axis}")
    if not 0 < distance < math.inf:
        raise InputError(f"spacing along axis {axis} is {distance:g}, and must be positive and finite")
    return distance


def _in_array_order(array: NDArray[Any], spacing: Sequence[float]) -> _marrow.ArrayVolume:
    """The volume whose points have the coordinates (axis 0, axis 1, axis 2)."""
    return _marrow.ArrayVolume(array, spacing[::-1], (0.0, 0.0, 0.0), np.eye(3)[::-1])


def _with_numbers_for_infinity(array: NDArray[Any]) -> NDArray[Any]:
    most = np.finfo(array.dtype).max  # elsewhere in Marrow, infinite samples are outside
    return np.clip(array, -most, most)


def _middle(array: NDArray[Any]) -> float:
    middle = 0.5 * float(array.min()) + 0.5 * float(array.max())  # their sum may overflow
    if not math.isfinite(middle):
        raise InputError("the volume has samples that are not finite: give the level")
    return middle


def _raise_for_range(array: NDArray[Any], level: float | None) -> None:
    low, high = float(array.min()), float(array.max())
    if level is not None and not low <= level <= high and not math.isnan(low):
        raise InputError(f"the level {level:g} is outside the range of the samples, {low:g} to {high:g}")
