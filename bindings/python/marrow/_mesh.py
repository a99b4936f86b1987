"""Triangle meshes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Union

import numpy as np

from ._marrow import InputError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


class Mesh:
    """A triangle mesh whose triangles share their points.

    Parameters
    ----------
    points : array_like, shape (n, 3)
        The positions of the points, in mm, LPS; float32.
    triangles : array_like, shape (m, 3)
        The indices of each triangle's points, counter-clockwise as seen from outside; int32.
    normals : array_like, shape (n, 3), optional
        One outward unit vector per point; float32.

    Raises
    ------
    InputError
        An array has another shape or no numbers, or a triangle names a point that does not exist.

    Notes
    -----
    Arrays with the given types in C order are used as they are; others are copied. The arrays of an extracted
    surface are the memory that Marrow wrote, without a copy. They may be changed, and stay valid without the
    mesh. Beyond 2^31 points, triangles are uint32.
    """

    points: np.ndarray
    triangles: np.ndarray
    normals: Union[np.ndarray, None]

    def __init__(self, points: ArrayLike, triangles: ArrayLike, normals: Union[ArrayLike, None] = None) -> None:
        self.points = _rows("points", points, np.float32)
        self.triangles = _indices(triangles, len(self.points))
        self.normals = None if normals is None else _rows("normals", normals, np.float32)
        if self.normals is not None and len(self.normals) != len(self.points):
            raise InputError(f"there are {len(self.normals)} normals for {len(self.points)} points")

    @classmethod
    def _of(cls, arrays: tuple) -> Mesh:
        mesh = cls.__new__(cls)
        mesh.points, mesh.triangles, mesh.normals = arrays
        return mesh

    def __repr__(self) -> str:
        return f"<marrow.Mesh: {len(self.points)} points, {len(self.triangles)} triangles>"


def _rows(name: str, values: ArrayLike, dtype: type) -> np.ndarray:
    array = np.asarray(values)
    if array.ndim != 2 or array.shape[1] != 3:
        raise InputError(f"{name} have the shape {array.shape} instead of (n, 3)")
    if array.dtype.kind not in "iuf":
        raise InputError(f"{name} cannot be of type {array.dtype}")
    return np.ascontiguousarray(array, dtype)


def _indices(values: ArrayLike, points: int) -> np.ndarray:
    array = np.asarray(values)
    if array.size == 0 and array.ndim < 2:
        array = np.empty((0, 3), np.int32)
    if array.dtype.kind not in "iu":
        raise InputError(f"triangles are indices, and cannot be of type {array.dtype}")
    if array.size and (array.min() < 0 or array.max() >= points):
        raise InputError(f"a triangle names a point that does not exist: there are {points}")
    return _rows("triangles", array, np.int32 if points <= 2**31 else np.uint32)
