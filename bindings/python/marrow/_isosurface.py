"""Isosurfaces of volumes."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NoReturn, Optional, Union

import numpy as np

from . import _marrow
from ._arrays import as_number
from ._as_volume import as_volume
from ._label_table import Colour
from ._marrow import Cancelled, EmptySurface, InputError
from ._mesh import Mesh
from ._scan import Progress, volume_of
from ._trust import Trust
from ._volume import Volume


@dataclass(frozen=True)
class TissuePreset:
    """A surface that encloses the CT samples of at least `lowest` Hounsfield units.

    Attributes
    ----------
    name : str
        As `extract` takes it, such as 'bone'.
    lowest : float
        HU.
    isovalue : float
        HU; half a unit below `lowest`, so that no sample equals it.
    colour : tuple of 3 floats
        Red, green, blue from 0 to 1.
    """

    name: str
    lowest: float
    isovalue: float
    colour: Colour


#: The tissues in CT that `extract` knows by name.
TISSUE_PRESETS = {name: TissuePreset(name, *values) for name, *values in _marrow.tissue_presets()}


def extract(
    volume: Any,
    isovalue: Union[float, str],
    *,
    closed: bool = False,
    normals: bool = True,
    snap: float = 0.0,
    topology: bool = False,
    trust: bool = False,
    keep_thin: bool = False,
    threads: int = 0,
    progress: Optional[Progress] = None,
) -> Mesh:
    """Extract the surface on which interpolated samples equal an isovalue, by marching cubes.

    A sample is inside if it is finite and equal to the isovalue or larger. Each edge of the grid between inside
    and outside has one point, which the triangles around it share. The result has the same bits on any number
    of threads and any processor.

    Parameters
    ----------
    volume : Volume or object that `as_volume` takes
        The volume; for an array [k, j, i], the points are in samples (i, j, k).
    isovalue : float or str
        In the unit of the values; 'otsu', which separates dark from bright; or for CT the name of a tissue in
        `TISSUE_PRESETS`, such as 'bone'. The mesh takes the tissue's name and colour.
    closed : bool
        Close the surface at the border of the volume, as if outside samples surrounded it.
    normals : bool
        Compute a unit normal for each point, from the gradient.
    snap : float
        Merge points within this fraction of an edge around a sample, 0 <= snap < 0.5: fewer points, and no slivers.
        0: do not merge.
    topology : bool
        Give the surface exactly the topology of the trilinear interpolant, instead of separating inside corners in
        every ambiguous face of a cell: thin walls stay whole. Not with `snap`.
    trust : bool
        Report in `Mesh.trust` how far isovalue and noise move each point.
    keep_thin : bool
        Restore walls that are too thin for the scan, at half of their own peak; `find_thin_walls` finds them. A fold
        of soft tissue between air looks the same as a thin wall of bone.
    threads : int
        Threads to use; 0: all.
    progress : callable, optional
        As for `read`.

    Returns
    -------
    Mesh
        The surface, in mm, LPS. Triangles are counter-clockwise as seen from the side of lower samples.

    Raises
    ------
    EmptySurface
        All samples are on one side of the isovalue, or an open surface has a single sample along an axis.
    InputError
        The isovalue is not finite, `snap` is out of range or goes with `topology`, or a tissue is named but the volume
        is not CT.
    LimitError
        More than 2^32 - 1 points, or not enough memory.
    Cancelled
        `progress` returned False.

    Examples
    --------
    >>> scan = marrow.read("head.nii.gz")
    >>> marrow.extract(scan, "bone", closed=True).write("bone.stl")
    """
    volume = as_volume(volume)
    samples = volume._native()
    value, tissue = _choose_isovalue(volume, samples, isovalue)

    def surface_of(from_samples: _marrow.ArrayVolume, stage: Optional[Progress]) -> Mesh:
        arrays = _marrow.extract(
            from_samples,
            value,
            closed=closed,
            normals=normals,
            snap=snap,
            topology=topology,
            threads=threads,
            progress=stage,
        )
        return Mesh._of(arrays, tissue.name, tissue.colour) if tissue else Mesh._of(arrays)

    stages = _stages(progress, 1 + 2 * bool(keep_thin) + bool(trust))
    mesh = surface_of(samples, next(stages))
    if len(mesh.triangles) == 0:
        _raise_empty(volume, samples, value, closed)
    walls = None
    if keep_thin:
        walls = _marrow.FoundWalls(
            samples, value, mesh._native(), noise=None, padding=volume._padding, threads=threads, progress=next(stages)
        )
        again = next(stages)
        if walls.area > 0:
            mesh = surface_of(volume_of(walls.restore(), volume.info)._native(), again)
        elif again is not None:
            answer = again(0.0)
            if isinstance(answer, (bool, np.bool_)) and not answer:
                raise Cancelled("cancelled")
            again(1.0)
    if trust:
        report = _marrow.trust(
            samples,
            mesh._native(),
            hounsfield=_is_hounsfield(volume, samples),
            padding=volume._padding,
            near_walls=walls.near(mesh._native()) if walls is not None else None,
            walls_restored=walls.area > 0 if walls is not None else None,
            threads=threads,
            progress=next(stages),
        )
        mesh.trust = Trust._of(report)
    return mesh


class IsosurfaceExtractor:
    """Extracts many surfaces from one volume, as for a slider.

    It keeps its buffers, and reads only the samples whose side of the surface can change. Several threads may use
    it: they take turns.

    Parameters
    ----------
    volume : Volume or object that `as_volume` takes
        The volume. Its samples stay alive with the extractor, and must not change.
    closed, normals, snap, topology, threads
        As for `extract`.
    device : str or int
        What extracts: 'cpu'; 'auto', a GPU if there is one; 'gpu', which must be there; or a device, also a software
        device, by its number in `devices` (digits alone), its name or a part of that. It keeps a copy of the samples,
        and gives the same bits. The CPU takes over, with a RuntimeWarning, for what the device cannot do: samples of
        more than 16 bits other than float32, `snap`, `topology`, a process that was forked after a device had been
        used, and where the device fails.

    Raises
    ------
    InputError
        `snap` is out of range or goes with `topology`.
    LimitError
        Not enough memory.
    DeviceError
        There is no such device.
    """

    def __init__(
        self,
        volume: Any,
        *,
        closed: bool = False,
        normals: bool = True,
        snap: float = 0.0,
        topology: bool = False,
        threads: int = 0,
        device: Union[str, int] = "cpu",
    ) -> None:
        self._native = _marrow.ArrayExtractor(
            as_volume(volume)._native(),
            closed=closed,
            normals=normals,
            snap=snap,
            topology=topology,
            threads=threads,
            device=str(device),
        )
        self._warned = False
        self._warn_of_failure()

    @property
    def device(self) -> str:
        """The name of the device that extracts, or 'cpu'."""
        return self._native.device or "cpu"

    def extract(self, isovalue: float, *, level: int = 0, progress: Optional[Progress] = None) -> Mesh:
        """Extract a surface: the mesh that `extract` gives, or an empty one.

        Parameters
        ----------
        isovalue : float
            In the unit of the values.
        level : int
            0 to 30. From 1, a preview from every 2^level-th sample along each axis, at their positions, which the CPU
            extracts.
        progress : callable, optional
            As for `read`.

        Returns
        -------
        Mesh
            The surface. Later calls do not change it. Once none of its arrays is referenced any more, the next
            call uses its memory.

        Raises
        ------
        InputError
            The isovalue is not finite, or `level` is out of range.
        LimitError
            More than 2^32 - 1 points, or not enough memory.
        Cancelled
            `progress` returned False. The extractor can be used as before.
        """
        value = as_number(isovalue, "the isovalue")
        mesh = Mesh._of(self._native.extract(value, level=level, progress=progress))
        self._warn_of_failure()
        return mesh

    def _warn_of_failure(self) -> None:
        if self._native.failure and not self._warned:
            self._warned = True
            warnings.warn(self._native.failure, RuntimeWarning, stacklevel=3)


def _stages(progress: Optional[Progress], count: int) -> Iterator[Optional[Progress]]:
    """Yield the progress functions of `count` stages that follow each other."""
    for stage in range(count):
        yield None if progress is None else partial(_report_stage, progress, stage, count)


def _report_stage(progress: Progress, stage: int, count: int, fraction: float) -> Any:
    return progress((stage + fraction) / count)


def _choose_isovalue(
    volume: Volume, samples: _marrow.ArrayVolume, isovalue: Union[float, str]
) -> tuple[float, Optional[TissuePreset]]:
    """Return the number that `isovalue` stands for, and the tissue if it names one."""
    if not isinstance(isovalue, str):
        return as_number(isovalue, "the isovalue"), None
    if isovalue == "otsu":
        return _marrow.otsu(samples, volume._padding), None
    if isovalue not in TISSUE_PRESETS:
        raise InputError(f"the isovalue is a number, 'otsu' or one of {', '.join(TISSUE_PRESETS)}, not {isovalue!r}")
    tissue = TISSUE_PRESETS[isovalue]
    _check_hounsfield(volume, samples, tissue)
    return tissue.isovalue, tissue


def _is_hounsfield(volume: Volume, samples: _marrow.ArrayVolume) -> bool:
    return _marrow.presets_apply(*_signs_of_ct(volume, samples))


def _signs_of_ct(volume: Volume, samples: _marrow.ArrayVolume) -> tuple[str, bool, float]:
    """The modality, whether the scan is DICOM, and the lowest sample."""
    modality = volume.info.series.modality if volume.info else ""
    is_dicom = volume.info is not None and volume.info.format == "DICOM"
    return modality, is_dicom, _marrow.histogram(samples, 2)["lower"]


def _check_hounsfield(volume: Volume, samples: _marrow.ArrayVolume, tissue: TissuePreset) -> None:
    modality, is_dicom, lowest = _signs_of_ct(volume, samples)
    if _marrow.presets_apply(modality, is_dicom, lowest):
        return
    if modality:
        reason = f"the modality of this scan is {modality}"
    elif is_dicom:
        reason = "this scan does not state its modality"
    else:
        reason = f"the lowest sample here, {lowest:g}, is not air"
    raise InputError(
        f"'{tissue.name}' is in Hounsfield units, which only CT has, and {reason}: give a number or 'otsu'"
    )


def check_for_cells(shape: Sequence[int], closed: bool) -> None:
    """Refuse an open surface of samples without a cell between them."""
    if not closed and min(shape) == 1:
        raise EmptySurface("an open surface needs at least 2 samples along each axis: give closed=True")


def _raise_empty(volume: Volume, samples: _marrow.ArrayVolume, isovalue: float, closed: bool) -> NoReturn:
    found = _marrow.histogram(samples, 2)
    if len(found["counts"]) == 0:
        raise EmptySurface("the volume has no finite sample, so there is no surface")
    check_for_cells(volume.samples.shape, closed)
    raise EmptySurface(
        f"no surface at isovalue {isovalue:g}: samples range from {found['lower']:g} to {found['upper']:g}"
    )
