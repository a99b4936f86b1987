"""Walls thinner than a scan can carry."""

from __future__ import annotations

from typing import Any, Optional, Union

import numpy as np
from numpy.typing import NDArray

from . import _marrow
from ._as_volume import as_volume
from ._isosurface import _choose_isovalue
from ._mesh import Mesh, as_mesh
from ._scan import Progress, ScanInfo, volume_of
from ._volume import Volume


class ThinWalls:
    """Where walls beside a surface fall below the isovalue, because they are thinner than the scan can carry."""

    def __init__(self, native: _marrow.FoundWalls, info: Optional[ScanInfo]) -> None:
        self._native = native
        self._info = info

    def __len__(self) -> int:
        """Return the number of connected walls."""
        return len(self.areas)

    def __repr__(self) -> str:
        places = "1 place" if len(self) == 1 else f"{len(self)} places"
        return f"<marrow.ThinWalls: {self.area:.4g} mm2 in {places}>"

    @property
    def area(self) -> float:
        """The area of all walls in mm2."""
        return self._native.area

    @property
    def areas(self) -> NDArray[np.float64]:
        """The area of each wall in mm2, the largest first; shape (N,)."""
        return self._native.areas

    @property
    def positions(self) -> NDArray[np.float64]:
        """A position on each wall, near its middle, in mm, LPS; shape (N, 3)."""
        return self._native.positions

    def restore(self) -> Volume:
        """Return a copy of the volume in which the walls reach the isovalue, so that its surface includes them.

        They then begin and end where the samples pass half of the wall's own peak over each side. Their thickness is
        right where it is above the width of the scan's blur; thinner walls get that width.

        Raises
        ------
        LimitError
            Not enough memory.
        """
        return volume_of(self._native.restore(), self._info)

    def near(self, mesh: Mesh) -> NDArray[np.bool_]:
        """Say for each point of a mesh whether it is within about one sample of a wall; shape (number of points,).

        These points are on the rims of the holes; in the surface of the restored volume, they are on the walls.
        """
        return self._native.near(as_mesh(mesh)._native())


def find_thin_walls(
    volume: Any,
    isovalue: Union[float, str],
    mesh: Mesh,
    *,
    noise: Optional[float] = None,
    threads: int = 0,
    progress: Optional[Progress] = None,
) -> ThinWalls:
    """Find where walls beside a surface fall below the isovalue, because they are thinner than the scan can carry.

    Blur lowers the peak of a thin wall, so that the surface has a hole there, or ends. `docs/accuracy.md` says how
    thin walls are found and how often. A fold of soft tissue between air looks the same as a thin wall of bone, and
    sharp edges can look like one.

    Parameters
    ----------
    volume : Volume or object that `as_volume` takes
        The volume.
    isovalue : float or str
        As for `extract`.
    mesh : Mesh
        The surface that `extract` gives at this isovalue.
    noise : float, optional
        The standard deviation of the noise, in the unit of the values. By default it is estimated.
    threads : int
        Threads to use; 0: all.
    progress : callable, optional
        As for `read`.

    Returns
    -------
    ThinWalls
        The same for any number of threads. It keeps the samples alive, which must not change.

    Raises
    ------
    InputError
        The isovalue is not finite, or a tissue for what is not CT.
    LimitError
        Not enough memory.
    Cancelled
        `progress` returned False.

    Examples
    --------
    >>> walls = marrow.find_thin_walls(scan, "bone", marrow.extract(scan, "bone"))
    >>> skull = marrow.extract(walls.restore(), "bone", closed=True, topology=True)
    """
    volume = as_volume(volume)
    samples = volume._native()
    value, _ = _choose_isovalue(volume, samples, isovalue)
    native = _marrow.FoundWalls(
        samples,
        value,
        as_mesh(mesh)._native(),
        noise=noise,
        padding=volume._padding,
        threads=threads,
        progress=progress,
    )
    return ThinWalls(native, volume.info)
