"""Volumes: samples on a regular grid, and the position of the grid in space."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal, Optional, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _marrow
from ._arrays import Array, as_array, as_numbers, as_samples, refuse_path, sample_dtype
from ._marrow import InputError

if TYPE_CHECKING:
    from ._scan import ScanInfo

Space = Literal["LPS", "RAS"]
Spacing = Union[float, Sequence[float], NDArray[Any]]

_IDENTITY = (1.0, 0.0)  # the rescale of samples that are values


class Geometry:
    """The position of a grid in space: spacing, origin and direction of the index axes (i, j, k), LPS in mm."""

    def __init__(
        self,
        shape: Sequence[int],
        *,
        spacing: Optional[Spacing] = None,
        origin: Optional[ArrayLike] = None,
        direction: Optional[ArrayLike] = None,
        affine: Optional[ArrayLike] = None,
        space: Space = "LPS",
    ) -> None:
        if len(shape) != 3:
            raise InputError(f"a volume has three axes, and the array has {len(shape)}")
        if affine is None:
            self.spacing = distances(1 if spacing is None else spacing)
            self.origin = _numbers("origin", (0, 0, 0) if origin is None else origin, (3,))
            self.direction = _numbers("direction", np.eye(3) if direction is None else direction, (3, 3))
            if not np.allclose(np.linalg.norm(self.direction, axis=0), 1, atol=1e-3):
                raise InputError("a column of direction is not a unit vector: distances belong into spacing")
        elif spacing is None and origin is None and direction is None:
            matrix = _numbers("affine", affine, (4, 4))
            if not np.array_equal(matrix[3], [0, 0, 0, 1]):
                raise InputError("the last row of affine is not 0 0 0 1")
            self.spacing = np.linalg.norm(matrix[:3, :3], axis=0)
            self.origin = matrix[:3, 3].copy()
            self.direction = matrix[:3, :3] / np.where(self.spacing > 0, self.spacing, 1)
        else:
            raise InputError("affine stands for spacing, origin and direction: give either")
        if space not in ("LPS", "RAS"):
            raise InputError(f"space is 'LPS' or 'RAS', not {space!r}")
        if space == "RAS":
            negate = np.array([-1.0, -1.0, 1.0])
            self.origin = negate * self.origin
            self.direction = negate[:, None] * self.direction
        self._make_read_only()
        _marrow.check_geometry(shape, self.spacing, self.origin, self.direction)

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._make_read_only()  # which copies and pickles of arrays are not

    def _make_read_only(self) -> None:
        for values in (self.spacing, self.origin, self.direction):
            values.flags.writeable = False


class Volume:
    """Samples on a regular grid, and the position of the grid in space.

    Sample ``array[k, j, i]`` lies at ``origin + direction @ (spacing * (i, j, k))``, in millimetres, in LPS:
    x to the patient's left, y to posterior, z to superior. This is the convention of ITK, whose arrays have
    this order of axes too.

    Parameters
    ----------
    array : array_like, shape (nz, ny, nx)
        The samples: an array, or an object with ``__array__``, ``__array_interface__``, ``__dlpack__`` or the
        buffer protocol. They are not copied, and must not change while Marrow works on them. The axes may have
        any order in memory and may run backward.
    spacing : float or sequence of 3 floats, optional
        The distances between neighbouring samples along (i, j, k), in mm; 1 by default.
    origin : sequence of 3 floats, optional
        The position of ``array[0, 0, 0]`` in mm; (0, 0, 0) by default.
    direction : array_like, shape (3, 3), optional
        Column a is the unit vector of index axis a of (i, j, k); the identity by default.
    affine : array_like, shape (4, 4), optional
        Maps (i, j, k, 1) to (x, y, z, 1). It stands for spacing, origin and direction.
    space : {'LPS', 'RAS'}
        The space of `origin` and `direction`, or of `affine`. RAS, which nibabel uses, is converted to LPS.
    info : ScanInfo, optional
        What the volume was read from.

    Raises
    ------
    InputError
        The array has not three axes or no real numbers, or is the path of a file; the geometry is singular or not
        finite, or `affine` is given together with another geometry.

    Notes
    -----
    Samples of type uint8, int8, uint16, int16, int32, float32, float64 and bool are used where they are. Other
    types are converted by each function that reads them: float16 to float32; uint32, int64 and uint64 to
    float64, which raises InputError for samples beyond 2^53; and foreign byte orders. Also copied are arrays
    in which no axis has its samples next to each other, such as ``array[:, :, ::2]``.
    """

    def __init__(
        self,
        array: Any,
        *,
        spacing: Optional[Spacing] = None,
        origin: Optional[ArrayLike] = None,
        direction: Optional[ArrayLike] = None,
        affine: Optional[ArrayLike] = None,
        space: Space = "LPS",
        info: Optional[ScanInfo] = None,
    ) -> None:
        from ._scan import ScanInfo  # which imports this module

        refuse_path(array)
        if info is not None and not isinstance(info, ScanInfo):
            raise InputError(f"info is the info of a volume that was read, not {info!r}")
        self._samples = as_array(array)
        self._rescale = _IDENTITY
        self._info = info
        self._geometry = Geometry(
            self._samples.shape, spacing=spacing, origin=origin, direction=direction, affine=affine, space=space
        )
        sample_dtype(self._samples.dtype)

    def _with_rescale(self, rescale: tuple[float, float]) -> Volume:
        self._rescale = rescale
        return self

    @property
    def array(self) -> Array:
        """The values, shape (nz, ny, nx): the array that the volume was made of.

        With a `rescale`, it is computed anew each time: read-only float32, twice or four times the memory of `samples`.
        """
        return self._samples if self._rescale == _IDENTITY else _values(self._samples, self._rescale)

    @property
    def samples(self) -> Array:
        """The samples as they are in memory, shape (nz, ny, nx): with a `rescale`, not the values."""
        return self._samples

    @property
    def rescale(self) -> tuple[float, float]:
        """The slope and the intercept: ``value = slope * sample + intercept``; (1.0, 0.0) if samples are values.

        Only `read` gives others, for samples of 8 or 16 bits whose values have a fraction, and what is made of its
        volume. Functions of Marrow take and give values.
        """
        return self._rescale

    @property
    def spacing(self) -> NDArray[np.float64]:
        """The distances between neighbouring samples along (i, j, k), in mm; read-only."""
        return self._geometry.spacing

    @property
    def origin(self) -> NDArray[np.float64]:
        """The position of ``array[0, 0, 0]``, LPS in mm; read-only."""
        return self._geometry.origin

    @property
    def direction(self) -> NDArray[np.float64]:
        """The unit vectors of the index axes (i, j, k) as columns, shape (3, 3); read-only."""
        return self._geometry.direction

    @property
    def affine(self) -> NDArray[np.float64]:
        """The map from (i, j, k, 1) to (x, y, z, 1), LPS in mm, shape (4, 4)."""
        affine = np.eye(4)
        affine[:3, :3] = self.direction * self.spacing
        affine[:3, 3] = self.origin
        return affine

    @property
    def shape(self) -> tuple[int, int, int]:
        """The numbers of samples (nz, ny, nx)."""
        nz, ny, nx = self._samples.shape
        return nz, ny, nx

    @property
    def dtype(self) -> np.dtype[Any]:
        """The type of `array`."""
        return self._samples.dtype if self._rescale == _IDENTITY else np.dtype(np.float32)

    @property
    def info(self) -> Optional[ScanInfo]:
        """What the volume was read from, or None."""
        return self._info

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is unusual about the scan that was read, one line each."""
        return self._info.warnings if self._info else ()

    @property
    def _padding(self) -> Optional[float]:
        return self._info.padding if self._info else None

    def __getitem__(self, key: tuple[slice, slice, slice]) -> Volume:
        """Return a part of the volume, at its place in space: ``volume[k0:k1, j0:j1, i0:i1]``.

        It shares the samples, as slices of arrays do. Steps may be larger than 1, or negative.
        """
        if not (isinstance(key, tuple) and len(key) == 3 and all(isinstance(part, slice) for part in key)):
            raise InputError("a part of a volume has three slices: volume[k0:k1, j0:j1, i0:i1]")
        ranges = [range(size)[part] for size, part in zip(reversed(self.shape), reversed(key))]
        first = np.array([indices.start for indices in ranges])
        step = np.array([indices.step for indices in ranges])
        return Volume(
            self._samples[key],
            spacing=self.spacing * np.abs(step),
            origin=self.origin + self.direction @ (self.spacing * first),
            direction=self.direction * np.sign(step),
            info=self._info,
        )._with_rescale(self._rescale)

    def __repr__(self) -> str:
        nz, ny, nx = self.shape
        spacing = " x ".join(f"{value:g}" for value in self.spacing)
        return f"<marrow.Volume: {nx} x {ny} x {nz} samples of {self._sample_text()}, {spacing} mm>"

    def _sample_text(self) -> str:
        if self._rescale == _IDENTITY:
            return str(self._samples.dtype)
        slope, intercept = self._rescale
        sign = "-" if intercept < 0 else "+"
        return f"{self._samples.dtype} * {slope:.7g} {sign} {abs(intercept):.7g}"

    def _repr_html_(self) -> str:
        from ._html import volume_html

        return volume_html(self)

    def _native(self, array: Optional[Array] = None) -> _marrow.ArrayVolume:
        """The samples, or others at their positions, for functions of C++."""
        samples = as_samples(self._samples if array is None else array)
        rescale = self._rescale if array is None else _IDENTITY
        return _marrow.ArrayVolume(samples, self.spacing, self.origin, self.direction, rescale)


def distances(spacing: Any) -> NDArray[np.float64]:
    """Return the distances along (i, j, k), of which one number stands for all."""
    return _numbers("spacing", spacing if np.iterable(spacing) else [spacing] * 3, (3,))


def _values(samples: Array, rescale: tuple[float, float]) -> Array:
    slope, intercept = rescale
    values: Array = np.empty(samples.shape, np.float32)
    for to, of_slice in zip(values, samples):  # float64 takes the memory of a slice only
        to[...] = slope * of_slice.astype(np.float64) + intercept
    values.flags.writeable = False
    return values


def _numbers(name: str, value: Any, shape: tuple[int, ...]) -> NDArray[np.float64]:
    numbers = as_numbers(value)
    if numbers is None or numbers.size != math.prod(shape):
        raise InputError(f"{name} is not {' x '.join(map(str, shape))} numbers: {value!r}")
    return numbers.reshape(shape)
