"""How far the points of a surface can be trusted."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Optional

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Noise:
    """The noise of a scan in tissue, in the unit of its values. The spread of the estimators is its uncertainty.

    Attributes
    ----------
    sigma : float
        The standard deviation: the lower of `local_deviation` and `slices`.
    lowest, highest : float
        Of the three estimators that follow.
    local_deviation : float
        The mode of the standard deviations in windows of 7 x 7 samples.
    slices : float or None
        From differences of neighbouring slices; None if there is one slice.
    laplacian : float
        From second differences within slices; sees only fine noise.
    windows : int
        The number of windows that were used; 0: too few suit, and nothing is known.
    """

    sigma: float
    lowest: float
    highest: float
    local_deviation: float
    slices: Optional[float]
    laplacian: float
    windows: int


@dataclass(frozen=True)
class TrustPercentiles:
    """The distribution of a distance over the points of a surface.

    Attributes
    ----------
    median, percentile_90, percentile_99 : float
        mm; half, 90 % and 99 % of the points have at most this distance.
    capped : int
        The number of points where it is larger than `Trust.cap`, and is given as that.
    """

    median: float
    percentile_90: float
    percentile_99: float
    capped: int


@dataclass(frozen=True, eq=False)
class Trust:
    """How far isovalue and noise move the points of a surface, as it was extracted.

    Attributes
    ----------
    step : float
        The change of the isovalue, in the unit of the values: 100 in CT, otherwise a tenth of the contrast.
    cap : float
        mm; the largest distance between neighbouring samples.
    noise : Noise
        The noise of the scan.
    shift : ndarray of float32, shape (n,)
        mm for each point: how far the surface moves if the isovalue changes by `step`.
    noise_shift : ndarray of float32, shape (n,)
        mm for each point: the standard deviation of its position by noise.
    shifts, noise_shifts : TrustPercentiles
        The distributions of `shift` and `noise_shift`.
    border_points : int
        The number of points outside the samples, such as those that close the surface at the border. They have 0, and
        no share in the percentiles.
    near_thin_walls : ndarray of bool, shape (n,)
        Whether each point is on or beside a wall that `keep_thin` restored.
    colours : ndarray of uint8, shape (n, 3)
        sRGB for each point, from light grey to dark red; blue beside restored walls.
    """

    step: float
    cap: float
    noise: Noise
    shift: NDArray[np.float32]
    noise_shift: NDArray[np.float32]
    shifts: TrustPercentiles
    noise_shifts: TrustPercentiles
    border_points: int
    near_thin_walls: NDArray[np.bool_]
    colours: NDArray[np.uint8]
    _meanings: tuple[tuple[str, str], ...]  # the names and meanings of the arrays in files

    @classmethod
    def _of(cls, found: dict[str, Any]) -> Trust:
        """Return the report that C++ gives as a dictionary."""
        return cls(
            step=found["step"],
            cap=found["cap"],
            noise=Noise(**found["noise"]),
            shift=found["shift"],
            noise_shift=found["noise_shift"],
            shifts=TrustPercentiles(**found["shifts"]),
            noise_shifts=TrustPercentiles(**found["noise_shifts"]),
            border_points=found["border_points"],
            near_thin_walls=found["near_thin_walls"],
            colours=found["colours"],
            _meanings=tuple(found["meanings"]),
        )

    def _arrays(self) -> list[tuple[str, str, NDArray[np.float32]]]:
        """Return what files hold of each point, as names, meanings and numbers."""
        numbers = (self.shift, self.noise_shift, self.near_thin_walls.astype(np.float32))
        return [(name, meaning, values) for (name, meaning), values in zip(self._meanings, numbers)]
