"""Volumes of other packages, which are recognized by their attributes."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Sequence
from typing import Any, Optional

import numpy as np

from ._arrays import Array, as_array
from ._marrow import InputError
from ._volume import Geometry, Volume

_NIFTI_UNITS = {1: 1e3, 3: 1e-3}  # mm by the codes for metres and micrometres; the others are taken as mm
_LENGTHS = {  # in mm
    **dict.fromkeys(("mm", "millimeter", "millimetre"), 1.0),
    **dict.fromkeys(("m", "meter", "metre"), 1e3),
    **dict.fromkeys(("cm", "centimeter", "centimetre"), 10.0),
    **dict.fromkeys(("um", "\u00b5m", "\u03bcm", "micrometer", "micrometre", "micron"), 1e-3),  # both signs of micro
    **dict.fromkeys(("nm", "nanometer", "nanometre"), 1e-6),
}


def as_volume(source: Any) -> Volume:
    """Return an image of another package as a volume at the same place in space, without a copy of its samples.

    Parameters
    ----------
    source : object
        A Volume; an image of ITK, SimpleITK or nibabel; vtkImageData, also PyVista's; an xarray.DataArray with
        evenly spaced coordinates; or an array [k, j, i], which has a spacing of 1 mm.

    Returns
    -------
    Volume
        The samples of the image. nibabel's RAS is converted to LPS, and the units of NIfTI and of xarray's
        coordinates to mm; nibabel and xarray scale and load samples that are not in memory. VTK and xarray do not say
        which way patients lie: their axes are taken as LPS. For a NIfTI image without sform and qform and for an
        image of Analyze, whose place is unknown, a RuntimeWarning says so.

    Raises
    ------
    InputError
        The image has not three dimensions, several components, no samples at its points, or coordinates that are uneven
        or no lengths; or `source` is the path of a file, which `read` takes.
    """
    if _has(source, "affine", "dataobj", "header"):
        return _of_nibabel(source)
    if _is_xarray(source):
        array, place = _of_xarray(source)
        return Volume(array, **place)
    return _in_memory(source) or Volume(source)


def as_slices(source: Any, **place: Any) -> tuple[Any, Geometry]:
    """Return what to take the samples of `source` from, slice by slice, and its place in space.

    Dask's arrays, also those of xarray, and arrays in files stay where they are. `place` is for arrays without one.
    """
    volume = _in_memory(source)
    if volume is not None:
        if volume.rescale != (1.0, 0.0):
            raise InputError(
                "the samples of this Volume are not its values: give Volume(volume.array, affine=volume.affine)"
            )
        array, geometry = volume.array, volume._geometry
    elif _is_xarray(source):
        array, own = _of_xarray(source)
        geometry = Geometry(_known_shape(array), **own)
    elif _has(source, "shape", "dtype", "__getitem__"):
        return source, Geometry(_known_shape(source), **place)
    else:
        raise InputError(f"a {type(source).__qualname__} has no shape, dtype and slices: give a path or an array")
    if any(value is not None for value in place.values()):
        raise InputError(f"a {type(source).__qualname__} has its own spacing, origin and direction: do not give others")
    return array, geometry


def _known_shape(array: Any) -> tuple[int, ...]:
    """Return the shape of an array, which Dask does not always know."""
    shape: tuple[int, ...] = array.shape
    if any(size != size for size in shape):  # NaN
        raise InputError("the array has chunks of unknown size: call its compute_chunk_sizes() first")
    return shape


def _in_memory(source: Any) -> Optional[Volume]:
    """Return a volume, or an image whose samples are in memory, as a volume."""
    if isinstance(source, Volume):
        return source
    if _has(source, "GetSpacing", "GetOrigin", "GetDirection", "GetLargestPossibleRegion"):
        return _of_itk(source)
    if _has(source, "GetSpacing", "GetOrigin", "GetDirection", "GetPixelIDValue"):
        return _of_simple_itk(source)
    if _has(source, "GetSpacing", "GetOrigin", "GetDirectionMatrix", "GetPointData"):
        return _of_vtk(source)
    return None


def _is_xarray(source: Any) -> bool:
    return _has(source, "dims", "coords", "data")


def _has(source: Any, *attributes: str) -> bool:
    return all(hasattr(source, attribute) for attribute in attributes)


class _Shared:
    """The samples of an image, as an array that keeps the image alive."""

    def __init__(self, array: Array, image: Any) -> None:
        self.__array_interface__ = array.__array_interface__
        self.image = image


def _module_of(image: Any) -> Any:
    return sys.modules[type(image).__module__.partition(".")[0]]


def _of_itk(image: Any) -> Volume:
    array = _module_of(image).array_view_from_image(image)
    matrix = image.GetDirection()
    if hasattr(matrix, "GetVnlMatrix"):
        vnl = matrix.GetVnlMatrix()
        matrix = [[vnl.get(row, column) for column in range(vnl.cols())] for row in range(vnl.rows())]
    return _of_itk_geometry(image, array, np.array(matrix, float), list(image.GetBufferedRegion().GetIndex()))


def _of_simple_itk(image: Any) -> Volume:
    array = _module_of(image).GetArrayViewFromImage(image)
    return _of_itk_geometry(image, array, np.array(image.GetDirection(), float), [0, 0, 0])


def _of_itk_geometry(image: Any, array: Array, direction: Any, first: list[int]) -> Volume:
    axes = len(image.GetSpacing())
    if axes != 3 or array.ndim != 3:
        raise InputError(
            f"the image has {axes} axes and an array of {array.ndim} axes: a volume has three, and one component"
        )
    return _placed(np.asarray(_Shared(array, image)), image, direction.reshape(3, 3), first)


def _placed(array: Array, image: Any, direction: Any, first: Sequence[int]) -> Volume:
    """Return an image whose first sample has the index `first`.

    Its origin is that of the index (0, 0, 0), which it need not have.
    """
    spacing = np.array(list(image.GetSpacing()))
    origin = np.array(list(image.GetOrigin())) + direction @ (spacing * first)
    direction = np.where(spacing < 0, -direction, direction)  # VTK's spacing may be negative
    return Volume(array, spacing=np.abs(spacing), origin=origin, direction=direction)


def _of_vtk(image: Any) -> Volume:
    scalars = image.GetPointData().GetScalars()
    if scalars is None:
        raise InputError("the vtkImageData has no active scalars at its points; samples of cells are not points")
    if scalars.GetNumberOfComponents() != 1:
        raise InputError(f"the vtkImageData has {scalars.GetNumberOfComponents()} components instead of one")
    if scalars.IsA("vtkBitArray"):
        raise InputError("the vtkImageData has samples of one bit: convert them to unsigned char")
    samples = as_array(scalars)
    if samples.dtype.kind == "S":  # the buffer of VTK's char, which is signed on most machines
        samples = samples.view(np.int8 if scalars.GetDataTypeMin() < 0 else np.uint8)
    nx, ny, nz = image.GetDimensions()
    if samples.size != nx * ny * nz:
        raise InputError(f"the vtkImageData has {samples.size} samples instead of {nx} x {ny} x {nz}")
    matrix = image.GetDirectionMatrix()
    direction = np.array([[matrix.GetElement(row, column) for column in range(3)] for row in range(3)])
    return _placed(samples.reshape(nz, ny, nx), image, direction, image.GetExtent()[::2])


def _of_nibabel(image: Any) -> Volume:
    array = np.asanyarray(image.dataobj)
    while array.ndim > 3 and array.shape[-1] == 1:
        array = array[..., 0]
    if array.ndim != 3:
        raise InputError(f"the image has {array.ndim} axes: choose a volume, for instance image.slicer[..., 0]")
    if image.affine is None:
        raise InputError("the image states no affine: give Volume its samples and their spacing")
    affine = np.array(image.affine, float)
    missing = _what_gives_no_place(image)
    if missing:
        # nibabel makes up an affine then, which mirrors the image.
        affine = np.diag([*(float(zoom) for zoom in image.header.get_zooms()[:3]), 1.0])
        warnings.warn(f"{missing}; position and orientation are unknown", RuntimeWarning, stacklevel=3)
    if hasattr(image.header, "get_xyzt_units"):  # NIfTI, which alone states a unit
        affine[:3] *= _NIFTI_UNITS.get(int(image.header["xyzt_units"]) & 7, 1)
    return Volume(array.T, affine=affine, space="RAS")  # the axes are i, j, k


def _what_gives_no_place(image: Any) -> Optional[str]:
    """Return what is missing in a header of nibabel that does not place the image in space."""
    header = image.header
    if hasattr(header, "get_xyzt_units"):
        is_placed = header["sform_code"] > 0 or header["qform_code"] > 0
        return None if is_placed else "the NIfTI header has neither sform nor qform"
    # Analyze, whose images get the base affine unless SPM has stored another one.
    is_base = hasattr(header, "get_base_affine") and np.array_equal(image.affine, header.get_base_affine())
    return "the Analyze header has no affine" if is_base else None


def _of_xarray(source: Any) -> tuple[Any, dict[str, Any]]:
    """Return the array, with its axes in the order z, y, x, and its place."""
    dims = tuple(source.dims)
    names = [str(dim).lower() for dim in dims]
    order = [dims[names.index(name)] for name in "zyx"] if sorted(names) == ["x", "y", "z"] else dims
    if len(order) != 3:
        raise InputError(f"the DataArray has the dimensions {dims}: choose three, with .isel()")
    array = source.data.transpose([dims.index(dim) for dim in order])
    spacing, origin, sign = np.ones(3), np.zeros(3), np.ones(3)
    for axis, dim in enumerate(reversed(order)):
        if dim not in source.coords:
            continue
        values = _lengths(source.coords[dim], dim)
        origin[axis] = values[0] if len(values) else 0
        if len(values) < 2:
            continue
        step = (values[-1] - values[0]) / (len(values) - 1)
        if step == 0 or not np.allclose(np.diff(values), step, rtol=1e-3, atol=0):
            raise InputError(f"the coordinates along {dim} are not evenly spaced: resample the DataArray first")
        spacing[axis], sign[axis] = abs(step), np.sign(step)
    return array, {"spacing": spacing, "origin": origin, "direction": np.diag(sign)}


def _lengths(coordinates: Any, dim: Any) -> Array:
    """Return the coordinates along a dimension in mm."""
    values = np.asarray(coordinates)
    if values.dtype.kind not in "iuf":
        raise InputError(
            f"the coordinates along {dim} are of type {values.dtype} and no lengths: drop them, with .drop_vars()"
        )
    unit = coordinates.attrs.get("units", "mm")
    if not isinstance(unit, str) or unit not in _LENGTHS:
        raise InputError(
            f"the coordinates along {dim} have the unit {unit!r}: convert them to one of {', '.join(_LENGTHS)}"
        )
    return values.astype(float) * _LENGTHS[unit]
