"""Filters that prepare a volume for extraction."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Optional

import numpy as np

from . import _marrow
from ._arrays import as_number
from ._as_volume import as_volume
from ._scan import Progress, volume_of
from ._volume import Volume, _numbers


def crop(volume: Any, lower: Sequence[float], upper: Sequence[float]) -> Volume:
    """Copy the smallest block of samples that holds all samples in a box.

    To cut by indices, and without a copy, slice the volume instead: ``volume[k0:k1, j0:j1, i0:i1]``.

    Parameters
    ----------
    volume : Volume or object that `as_volume` takes
        The volume. One whose axes are oblique keeps more than the box.
    lower, upper : sequence of 3 floats
        The corners of the box (x, y, z), LPS in mm.

    Returns
    -------
    Volume
        A copy of the samples, of the same type, with the geometry of their place.

    Raises
    ------
    InputError
        No sample lies in the box, or a corner is not three numbers.
    """
    volume = as_volume(volume)
    samples = volume.samples
    # To copy samples of any type, it is enough that C++ takes a type of their size.
    same_size = samples.view({1: np.int8, 2: np.int16, 4: np.int32, 8: np.float64}[samples.itemsize])
    array, spacing, origin, direction, _ = _marrow.crop(
        volume._native(same_size), _numbers("lower", lower, (3,)), _numbers("upper", upper, (3,))
    )
    return volume_of((array.view(samples.dtype), spacing, origin, direction, volume.rescale), volume.info)


def median_filter(volume: Any, radius: int, *, threads: int = 0, progress: Optional[Progress] = None) -> Volume:
    """Replace each sample by the median of the samples around it, which removes single noisy samples.

    Parameters
    ----------
    volume : Volume or object that `as_volume` takes
        The volume.
    radius : int
        Samples to each side, 1 to 16: the window has 2 `radius` + 1 samples along each axis, and the time grows with
        the cube of that: on one thread of a slow machine, from 0.5 us a sample at radius 1 to 15 us at 5.
    threads : int
        Threads to use; 0: all.
    progress : callable, optional
        As for `read`.

    Returns
    -------
    Volume
        The result, of the same type. NaN stays NaN.

    Raises
    ------
    InputError
        `radius` is out of range.
    Cancelled
        `progress` returned False.
    """
    volume = as_volume(volume)
    array, spacing, origin, direction, rescale = _marrow.median_filter(
        volume._native(), radius, threads=threads, progress=progress
    )
    array = array.astype(volume.samples.dtype, copy=False)
    return volume_of((array, spacing, origin, direction, rescale), volume.info)


def gaussian_filter(volume: Any, sigma: float, *, threads: int = 0, progress: Optional[Progress] = None) -> Volume:
    """Blur a volume with a Gaussian.

    Parameters
    ----------
    volume : Volume or object that `as_volume` takes
        The volume.
    sigma : float
        The standard deviation in mm.
    threads : int
        Threads to use; 0: all.
    progress : callable, optional
        As for `read`.

    Returns
    -------
    Volume
        The result, of type float32, or float64 for int32 and float64.

    Raises
    ------
    InputError
        `sigma` is not positive and finite.
    Cancelled
        `progress` returned False.
    """
    volume = as_volume(volume)
    sigma = as_number(sigma, "sigma")
    return volume_of(
        _marrow.gaussian_filter(volume._native(), sigma, threads=threads, progress=progress), volume.info
    )


def resample_isotropic(
    volume: Any, spacing: float, *, threads: int = 0, progress: Optional[Progress] = None
) -> Volume:
    """Resample a volume to the same spacing along all axes, by cubic convolution (Keys 1981).

    Parameters
    ----------
    volume : Volume or object that `as_volume` takes
        The volume.
    spacing : float
        The new spacing in mm. Before a coarser one, blur: this function does not.
    threads : int
        Threads to use; 0: all.
    progress : callable, optional
        As for `read`.

    Returns
    -------
    Volume
        The result, of type float32, or float64 for int32 and float64.

    Raises
    ------
    InputError
        `spacing` is not positive and finite.
    LimitError
        The result is too large for the memory.
    Cancelled
        `progress` returned False.
    """
    volume = as_volume(volume)
    spacing = as_number(spacing, "spacing")
    return volume_of(
        _marrow.resample_isotropic(volume._native(), spacing, threads=threads, progress=progress), volume.info
    )
