"""Volumes of other packages, which are recognized by their attributes."""

from __future__ import annotations

import sys
from typing import Any, Optional

import numpy as np

from ._arrays import Array, as_array
from ._marrow import InputError
from ._volume import Geometry, Volume

_NIFTI_UNITS = {1: 1e3, 3: 1e-3}  # mm by the codes for metres and micrometres; the others are taken as mm


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
        The samples of the image. nibabel's RAS is converted to LPS, and NIfTI's metres and micrometres to mm; nibabel
        and xarray scale and load samples that are not in memory. VTK and xarray do not say which way patients lie:
        their axes are taken as LPS.

    Raises
    ------
    InputError
        The image has not three dimensions, several components, no samples at its points, or uneven coordinates.
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
        array, geometry = volume.array, volume._geometry
    elif _is_xarray(source):
        array, own = _of_xarray(source)
        geometry = Geometry(array.shape, **own)
    elif _has(source, "shape", "dtype", "__getitem__"):
        return source, Geometry(source.shape, **place)
    else:
        raise InputError(f"a {type(source).__qualname__} has no shape, dtype and slices: give a path or an array")
    if any(value is not None for value in place.values()):
        raise InputError(f"a {type(source).__qualname__} has its own spacing, origin and direction: do not give others")
    return array, geometry


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
    return _of_itk_geometry(image, array, np.array(matrix, float))


def _of_simple_itk(image: Any) -> Volume:
    array = _module_of(image).GetArrayViewFromImage(image)
    return _of_itk_geometry(image, array, np.array(image.GetDirection(), float))


def _of_itk_geometry(image: Any, array: Array, direction: Any) -> Volume:
    if array.ndim != 3:
        raise InputError(f"the image has an array of {array.ndim} axes: a volume has three, and one component")
    return Volume(
        np.asarray(_Shared(array, image)),
        spacing=list(image.GetSpacing()),
        origin=list(image.GetOrigin()),
        direction=direction.reshape(3, 3),
    )


def _of_vtk(image: Any) -> Volume:
    scalars = image.GetPointData().GetScalars()
    if scalars is None:
        raise InputError("the vtkImageData has no active scalars at its points; samples of cells are not points")
    if scalars.GetNumberOfComponents() != 1:
        raise InputError(f"the vtkImageData has {scalars.GetNumberOfComponents()} components instead of one")
    nx, ny, nz = image.GetDimensions()
    spacing = np.array(image.GetSpacing())
    matrix = image.GetDirectionMatrix()
    direction = np.array([[matrix.GetElement(row, column) for column in range(3)] for row in range(3)])
    # The origin is that of the index (0, 0, 0), which need not be in the extent.
    first = np.array(image.GetExtent()[::2])
    return Volume(
        as_array(scalars).reshape(nz, ny, nx),
        spacing=spacing,
        origin=np.array(image.GetOrigin()) + direction @ (spacing * first),
        direction=direction,
    )


def _of_nibabel(image: Any) -> Volume:
    array = np.asanyarray(image.dataobj)
    while array.ndim > 3 and array.shape[-1] == 1:
        array = array[..., 0]
    if array.ndim != 3:
        raise InputError(f"the image has {array.ndim} axes: choose a volume, for instance image.slicer[..., 0]")
    if image.affine is None:
        raise InputError("the image states no affine: give Volume its samples and their spacing")
    affine = np.array(image.affine, float)
    if hasattr(image.header, "get_xyzt_units"):  # only NIfTI states a unit
        affine[:3] *= _NIFTI_UNITS.get(int(image.header["xyzt_units"]) & 7, 1)
    return Volume(array.T, affine=affine, space="RAS")  # the axes are i, j, k


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
        values = np.asarray(source.coords[dim], float)
        origin[axis] = values[0] if len(values) else 0
        if len(values) < 2:
            continue
        step = (values[-1] - values[0]) / (len(values) - 1)
        if step == 0 or not np.allclose(np.diff(values), step, rtol=1e-3, atol=0):
            raise InputError(f"the coordinates along {dim} are not evenly spaced: resample the DataArray first")
        spacing[axis], sign[axis] = abs(step), np.sign(step)
    return array, {"spacing": spacing, "origin": origin, "direction": np.diag(sign)}
