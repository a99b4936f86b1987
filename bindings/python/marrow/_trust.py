"""How far the points of a surface can be trusted."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Optional

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Noise:
    """The noise of a scan in tissue, in the unit of its values. The spread of the estimators is its uncertainty."""

    sigma: float  #: standard deviation: the lower of `local_deviation` and `slices`
    lowest: float  #: of the three estimators
    highest: float  #: of the three estimators
    local_deviation: float  #: the mode of the standard deviations in windows of 7 x 7 samples
    slices: Optional[float]  #: from differences of neighbouring slices; None if there is one slice
    laplacian: float  #: from second differences within slices; sees only fine noise
    windows: int  #: windows that were used; 0: too few suit, and nothing is known


@dataclass(frozen=True)
class TrustPercentiles:
    """The distribution of a distance over the points of a surface, in mm."""

    median: float
    percentile_90: float
    percentile_99: float
    capped: int  #: points where it is larger than one sample, and is given as one sample


@dataclass(frozen=True, eq=False)
class Trust:
    """How far isovalue and noise move the points of a surface, as it was extracted."""

    step: float  #: the change of the isovalue: 100 in CT, otherwise a tenth of the contrast
    cap: float  #: mm; the largest distance between neighbouring samples
    noise: Noise  #: of the scan
    shift: NDArray[np.float32]  #: mm for each point: how far the surface moves if the isovalue changes by `step`
    noise_shift: NDArray[np.float32]  #: mm for each point: the standard deviation of its position by noise
    shifts: TrustPercentiles  #: of `shift`
    noise_shifts: TrustPercentiles  #: of `noise_shift`
    #: points outside the samples, such as those that close the surface at the border; they have 0, and no share in the
    #: percentiles
    border_points: int
    near_thin_walls: NDArray[np.bool_]  #: for each point: whether it is on or beside a wall that `keep_thin` restored
    colours: NDArray[np.uint8]  #: sRGB for each point, from light grey to dark red; blue beside restored walls; (n, 3)
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
