"""Reads scans."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Optional, Union

from . import _marrow
from ._volume import Volume

Path = Union[str, "os.PathLike[str]"]
Progress = Callable[[float], Any]


@dataclass(frozen=True)
class SeriesInfo:
    """One series or image of an input."""

    id: str  #: SeriesInstanceUID, with /1, /2, ... if it holds several volumes; else empty
    description: str  #: SeriesDescription or file name; never the patient's name
    modality: str  #: "CT", "MR", ...; empty if the format does not state it
    shape: tuple[int, int, int]  #: numbers of samples (nz, ny, nx)
    spacing: tuple[float, float, float]  #: mm along (i, j, k); 0 where it is unknown
    files: int  #: number of files that it is made of


@dataclass(frozen=True)
class ScanInfo:
    """What a volume was read from."""

    format: str  #: "DICOM", "NIfTI", "NRRD", "MetaImage", "Zarr", "TIFF" or "slices"
    series: SeriesInfo
    warnings: tuple[str, ...]  #: one line each
    padding: Optional[float]  #: PixelPaddingValue of DICOM as a sample: the value outside the field of view


@dataclass(frozen=True)
class SeriesReport:
    """What the headers tell about one series."""

    series: SeriesInfo
    number: Optional[int]  #: SeriesNumber of DICOM
    date: str  #: SeriesDate of DICOM: "2005-07-26"; empty if it is not stated
    echo_time: Optional[float]  #: ms
    image_type: str  #: ImageType of DICOM
    kernel: str  #: ConvolutionKernel of DICOM
    refusal: Optional[str]  #: why `read` would fail, if the headers show it
    warnings: tuple[str, ...]  #: the warnings of `read`
    gaps: tuple[str, ...]  #: unusual gaps between slices
    tilt: float  #: of the gantry, degrees
    hounsfield: Optional[bool]  #: whether samples are Hounsfield units, if known
    smallest_feature: Optional[float]  #: mm; twice the coarsest spacing: the finest visible detail
    memory: int  #: bytes that the samples need
    volumes: tuple[str, ...]  #: what tells the volumes of a series apart, if it has several
    levels: tuple[tuple[int, int, int], ...]  #: the shape (nz, ny, nx) of each level of an OME-Zarr image
    patient_name: str = field(repr=False)  #: as in DICOM: "family^given"; show it only on request


@dataclass(frozen=True)
class ScanReport:
    """What an input holds."""

    format: str  #: as of ScanInfo
    files: int  #: number of files inspected
    series: tuple[SeriesReport, ...]
    chosen: Optional[int]  #: index of the series that `read` would read
    reason: str  #: why `read` would read that series, or none
    warnings: tuple[str, ...]  #: about files that are skipped


def read(
    path: Path,
    *,
    series: Optional[str] = None,
    spacing: Optional[Sequence[float]] = None,
    resample: bool = False,
    volume: Optional[int] = None,
    level: Optional[int] = None,
    threads: int = 0,
    progress: Optional[Progress] = None,
) -> Volume:
    """Read a scan: DICOM, NIfTI, NRRD, MetaImage, OME-Zarr, TIFF, or a folder of image slices.

    Parameters
    ----------
    path : path-like
        A file, or a folder of DICOM files, OME-Zarr or image slices. The content decides the format.
    series : str, optional
        The ``id`` of a series or the first part of it, or its number in the list of `inspect`, from 1; needed if
        the input holds several.
    spacing : sequence of 3 floats, optional
        mm along (i, j, k); only for input that does not state it, such as image slices.
    resample : bool
        Interpolate unevenly spaced DICOM slices to even spacing, instead of refusing them.
    volume : int, optional
        The index of a volume, from 0, if the input holds several: time points or echoes of DICOM, a 4-D file,
        channels of OME-Zarr.
    level : int, optional
        The level of an OME-Zarr image's resolutions, from 0, the finest.
    threads : int
        Threads to use; 0: all.
    progress : callable, optional
        Called with the fraction that is done, from 0 to 1. Where it returns False, the work stops and raises
        Cancelled.

    Returns
    -------
    Volume
        The samples in the type of the file, shape (nz, ny, nx), in LPS. DICOM is rescaled, to Hounsfield units
        for CT. Samples of 8 or 16 bits whose values have a fraction stay as stored: see `Volume.rescale`.

    Raises
    ------
    IoError
        A file is missing or cannot be read.
    InputError
        A file is damaged or not supported.
    GeometryError
        Several series, uneven slices, or no spacing.
    LimitError
        The scan is too large for the memory.
    Cancelled
        `progress` returned False.
    """
    placed, info = _marrow.read(
        path,
        series=series,
        spacing=spacing,
        resample=resample,
        volume=volume,
        level=level,
        threads=threads,
        progress=progress,
    )
    return volume_of(placed, ScanInfo(info["format"], SeriesInfo(**info["series"]), info["warnings"], info["padding"]))


def inspect(
    path: Path,
    *,
    series: Optional[str] = None,
    spacing: Optional[Sequence[float]] = None,
    resample: bool = False,
    volume: Optional[int] = None,
    level: Optional[int] = None,
    threads: int = 0,
    progress: Optional[Progress] = None,
) -> ScanReport:
    """Report what `read` would do with the same arguments, from the headers alone.

    Parameters
    ----------
    path, series, spacing, resample, volume, level, threads, progress
        As for `read`.

    Returns
    -------
    ScanReport
        The series, the one that would be read, and why.

    Raises
    ------
    IoError, InputError, GeometryError, Cancelled
        As `read`, if there is no image at all or an argument does not apply to the input.
    """
    report = _marrow.inspect(
        path,
        series=series,
        spacing=spacing,
        resample=resample,
        volume=volume,
        level=level,
        threads=threads,
        progress=progress,
    )
    series_reports = tuple(
        SeriesReport(series=SeriesInfo(**one.pop("series")), **one) for one in report.pop("series")
    )
    return ScanReport(series=series_reports, **report)


def volume_of(placed: tuple[Any, Any, Any, Any, tuple[float, float]], info: Optional[ScanInfo]) -> Volume:
    """Return the volume that C++ gives as (array, spacing, origin, direction, rescale)."""
    array, spacing, origin, direction, rescale = placed
    return Volume(array, spacing=spacing, origin=origin, direction=direction, info=info)._with_rescale(rescale)
