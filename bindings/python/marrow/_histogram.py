"""How a volume's samples are distributed, and how its surface depends on the isovalue."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Optional, Union

import numpy as np
from numpy.typing import NDArray

from . import _marrow
from ._arrays import as_numbers
from ._as_volume import as_volume
from ._marrow import InputError
from ._scan import Progress


@dataclass(frozen=True, eq=False)
class Histogram:
    """Counts of samples in equal bins from the smallest to the largest finite sample that is not padding.

    Attributes
    ----------
    lower : float
        The smallest of these samples, in the unit of the values.
    upper : float
        The largest of them, which is in the last bin.
    counts : ndarray of int64, shape (bins,)
        The number of samples in each bin; empty if no sample is finite.
    non_finite_samples : int
        NaN and infinite samples, which are in no bin.
    """

    lower: float
    upper: float
    counts: NDArray[np.int64]
    non_finite_samples: int

    @property
    def edges(self) -> NDArray[np.float64]:
        """The borders of the bins: one more than `counts` has, as of numpy.histogram."""
        return np.linspace(self.lower, self.upper, len(self.counts) + 1)


def histogram(volume: Any, bins: int = 256) -> Histogram:
    """Count the samples of a volume in `bins` bins.

    Padding (`ScanInfo.padding`) is left out, unless that leaves fewer than two values.

    Raises
    ------
    InputError
        `bins` is below 2.
    """
    volume = as_volume(volume)
    return Histogram(**_marrow.histogram(volume._native(), bins, volume._padding))


def otsu(volume: Any) -> float:
    """Return the isovalue that best separates the samples into dark and bright (Otsu 1979).

    Raises
    ------
    InputError
        All samples are equal, or none is finite.
    """
    volume = as_volume(volume)
    return _marrow.otsu(volume._native(), volume._padding)


@dataclass(frozen=True, eq=False)
class Sweep:
    """Measures of the closed surfaces at several isovalues; arrays of the same length.

    Attributes
    ----------
    isovalue : ndarray of float64
        The isovalues, in the unit of the volume's values.
    volume : ndarray of float64
        The enclosed volume in mm^3.
    area : ndarray of float64
        The area in mm^2.
    components : ndarray of int64
        The number of connected components.
    triangles : ndarray of int64
        The number of triangles.
    """

    isovalue: NDArray[np.float64]
    volume: NDArray[np.float64]
    area: NDArray[np.float64]
    components: NDArray[np.int64]
    triangles: NDArray[np.int64]


def sweep(
    volume: Any,
    isovalues: Union[Sequence[float], NDArray[Any]],
    *,
    topology: bool = False,
    threads: int = 0,
    progress: Optional[Progress] = None,
) -> Sweep:
    """Measure the closed surfaces at many isovalues, without extracting them.

    Parameters
    ----------
    volume : Volume or object that `as_volume` takes
        The volume.
    isovalues : sequence of floats
        Ascending.
    topology : bool
        As for `extract`; takes longer, since the surfaces are then extracted.
    threads : int
        Threads to use; 0: all.
    progress : callable, optional
        As for `read`.

    Raises
    ------
    InputError
        `isovalues` are not numbers, have a mask, or are not finite and ascending.
    Cancelled
        `progress` returned False.
    """
    values = as_numbers(isovalues)
    if values is None or values.ndim != 1:
        raise InputError("isovalues are a sequence of numbers, such as [100, 200]")
    native = as_volume(volume)._native()
    return Sweep(**_marrow.sweep(native, values, topology=topology, threads=threads, progress=progress))


def find_plateaus(sweep: Sweep, volume: Any) -> list[tuple[float, float]]:
    """Find the ranges of isovalues in which the surface hardly moves.

    Any isovalue in such a range is a good choice.

    Parameters
    ----------
    sweep : Sweep
        The result of `sweep` for the same volume.
    volume : Volume or object that `as_volume` takes
        The volume. Its spacing and its contrast tell how far a surface may move.

    Returns
    -------
    list of (float, float)
        The first and the last isovalue of each plateau.

    Raises
    ------
    InputError
        The arrays of `sweep` differ in length.
    """
    if not isinstance(sweep, Sweep):
        raise InputError(f"a {type(sweep).__qualname__} is not a Sweep: marrow.sweep makes one")
    volume = as_volume(volume)
    return _marrow.find_plateaus(
        sweep.isovalue,
        sweep.volume,
        sweep.area,
        sweep.triangles,
        spacing=min(volume.spacing),
        contrast=_marrow.otsu_contrast(volume._native(), volume._padding),
    )
