"""Reads scans."""

from __future__ import annotations

import operator
import os
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Optional, Union

from . import _marrow
from ._label_table import LabelEntry, label_table
from ._marrow import InputError
from ._volume import Spacing, Volume, distances

Path = Union[str, "os.PathLike[str]"]
Progress = Callable[[float], Any]


@dataclass(frozen=True)
class SeriesInfo:
    """One series or image of an input.

    Attributes
    ----------
    id : str
        SeriesInstanceUID, with /1, /2, ... if it holds several volumes; else empty.
    description : str
        SeriesDescription or file name; never the patient's name.
    modality : str
        "CT", "MR", ...; empty if the format does not state it.
    shape : tuple of 3 ints
        The numbers of samples (nz, ny, nx).
    spacing : tuple of 3 floats
        mm along (i, j, k); 0 where it is unknown.
    files : int
        The number of files that it is made of.
    labels : dict of int to LabelEntry
        The names and colours of the segments of a segmentation (DICOM's or 3D Slicer's), by label; else empty.
    """

    id: str
    description: str
    modality: str
    shape: tuple[int, int, int]
    spacing: tuple[float, float, float]
    files: int
    labels: dict[int, LabelEntry] = field(default_factory=dict, hash=False)


@dataclass(frozen=True)
class ScanInfo:
    """What a volume was read from.

    Attributes
    ----------
    format : str
        "DICOM", "NIfTI", "NRRD", "MetaImage", "Zarr", "TIFF" or "slices".
    series : SeriesInfo
        The series or image.
    warnings : tuple of str
        What is unusual about it, one line each.
    padding : float or None
        The value outside the field of view, which DICOM states as PixelPaddingValue.
    """

    format: str
    series: SeriesInfo
    warnings: tuple[str, ...]
    padding: Optional[float]


@dataclass(frozen=True)
class SeriesReport:
    """What the headers tell about one series.

    Attributes
    ----------
    series : SeriesInfo
        Its id, shape and so on.
    number : int or None
        SeriesNumber of DICOM.
    date : str
        SeriesDate of DICOM, as "2005-07-26"; empty if it is not stated.
    echo_time : float or None
        ms.
    image_type : str
        ImageType of DICOM.
    kernel : str
        ConvolutionKernel of DICOM.
    refusal : str or None
        Why `read` would fail, if the headers show it.
    warnings : tuple of str
        The warnings of `read`.
    gaps : tuple of str
        Unusual gaps between slices, one line each.
    tilt : float
        The tilt of the gantry in degrees.
    hounsfield : bool or None
        Whether samples are Hounsfield units, if known.
    smallest_feature : float or None
        mm; twice the coarsest spacing: the finest visible detail.
    memory : int
        Bytes that the samples need; 0 if they cannot be read.
    volumes : tuple of str
        What tells the volumes of a series apart, such as "echo time 12 ms", if it has several.
    levels : tuple of tuples of 3 ints
        The shape (nz, ny, nx) of each level of an OME-Zarr image.
    patient_name : str
        As in DICOM: "family^given". It is not in the repr: show it only on request.
    """

    series: SeriesInfo
    number: Optional[int]
    date: str
    echo_time: Optional[float]
    image_type: str
    kernel: str
    refusal: Optional[str]
    warnings: tuple[str, ...]
    gaps: tuple[str, ...]
    tilt: float
    hounsfield: Optional[bool]
    smallest_feature: Optional[float]
    memory: int
    volumes: tuple[str, ...]
    levels: tuple[tuple[int, int, int], ...]
    patient_name: str = field(repr=False)


@dataclass(frozen=True)
class ScanReport:
    """What an input holds.

    Attributes
    ----------
    format : str
        As of ScanInfo.
    files : int
        The number of files inspected.
    series : tuple of SeriesReport
        The series; `read` takes their numbers in this list, from 1.
    chosen : int or None
        The index in `series`, from 0, of the one that `read` would read.
    reason : str
        Why `read` would read that series, or none.
    warnings : tuple of str
        About files that are skipped, one line each.
    """

    format: str
    files: int
    series: tuple[SeriesReport, ...]
    chosen: Optional[int]
    reason: str
    warnings: tuple[str, ...]


def read(
    path: Path,
    *,
    series: Union[str, int, None] = None,
    spacing: Optional[Spacing] = None,
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
    series : str or int, optional
        The ``id`` of a series or the first part of it, or its number in the list of `inspect`, from 1; needed if
        the input holds several.
    spacing : float or sequence of 3 floats, optional
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
        A file is damaged or not supported, or an argument does not apply to it.
    GeometryError
        Several series, uneven slices, or no spacing.
    LimitError
        The scan is too large for the memory.
    Cancelled
        `progress` returned False.
    """
    placed, info = _marrow.read(
        path,
        series=_text_of_series(series),
        spacing=None if spacing is None else distances(spacing),
        resample=resample,
        volume=volume,
        level=level,
        threads=threads,
        progress=progress,
    )
    return volume_of(placed, ScanInfo(info["format"], _series_of(info["series"]), info["warnings"], info["padding"]))


def inspect(
    path: Path,
    *,
    series: Union[str, int, None] = None,
    spacing: Optional[Spacing] = None,
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
        series=_text_of_series(series),
        spacing=None if spacing is None else distances(spacing),
        resample=resample,
        volume=volume,
        level=level,
        threads=threads,
        progress=progress,
    )
    series_reports = tuple(SeriesReport(series=_series_of(one.pop("series")), **one) for one in report.pop("series"))
    return ScanReport(series=series_reports, **report)


def _series_of(info: dict[str, Any]) -> SeriesInfo:
    return SeriesInfo(labels=label_table(info.pop("labels")), **info)


def _text_of_series(series: Union[str, int, None]) -> Optional[str]:
    if series is None or isinstance(series, str):
        return series
    try:
        return str(operator.index(series))
    except TypeError:
        raise InputError(f"series is an id or a number, not {series!r}") from None


def volume_of(placed: tuple[Any, Any, Any, Any, tuple[float, float]], info: Optional[ScanInfo]) -> Volume:
    """Return the volume that C++ gives as (array, spacing, origin, direction, rescale)."""
    array, spacing, origin, direction, rescale = placed
    return Volume(array, spacing=spacing, origin=origin, direction=direction, info=info)._with_rescale(rescale)
