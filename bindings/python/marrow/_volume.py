"""Volumes: samples on a regular grid, and the position of the grid in space."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, Sequence, Union

import numpy as np

from . import _marrow
from ._arrays import as_array, as_samples
from ._marrow import InputError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from ._scan import ScanInfo

Space = Literal["LPS", "RAS"]

# LPS to RAS and back: x and y change their signs.
_LPS_TO_RAS = np.diag([-1.0, -1.0, 1.0])


class Volume:
    """Samples on a regular grid, and the position of the grid in space.

    Sample ``array[k, j, i]`` lies at ``origin + direction @ (spacing * (i, j, k))``, in millimetres, in LPS:
    x to the patient's left, y to posterior, z to superior. This is the convention of ITK, whose arrays have
    this order too.

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
        The space of `origin` and `direction`, or of `affine`. RAS, as nibabel has it, is converted to LPS.
    info : ScanInfo, optional
        Where the volume was read from.

    Raises
    ------
    InputError
        The array has not three axes or no numbers, the geometry is singular or not finite, or `affine` is
        given together with another geometry.

    Notes
    -----
    Samples of type uint8, int8, uint16, int16, int32, float32, float64 and bool are used as they are. Each
    function copies samples of other types: float16, as float32; uint32, int64 and uint64, as float64, where
    float64 holds them exactly, and else raises InputError; and samples in another byte order.
    """

    def __init__(
        self,
        array: Any,
        *,
        spacing: Union[float, Sequence[float], None] = None,
        origin: Union[Sequence[float], None] = None,
        direction: Union[ArrayLike, None] = None,
        affine: Union[ArrayLike, None] = None,
        space: Space = "LPS",
        info: Union[ScanInfo, None] = None,
    ) -> None:
        self._array = as_array(array)
        self._info = info
        if self._array.ndim != 3:
            raise InputError(f"a volume has three axes, and the array has {self._array.ndim}")
        if affine is None:
            self._spacing = _numbers("spacing", 1.0 if spacing is None else spacing, (3,))
            self._origin = _numbers("origin", (0.0, 0.0, 0.0) if origin is None else origin, (3,))
            self._direction = _numbers("direction", np.eye(3) if direction is None else direction, (3, 3))
            if not np.allclose(np.linalg.norm(self._direction, axis=0), 1, atol=1e-3):
                raise InputError("a column of direction is not a unit vector; the spacing belongs into spacing")
        elif spacing is None and origin is None and direction is None:
            matrix = _numbers("affine", affine, (4, 4))
            if not np.array_equal(matrix[3], [0, 0, 0, 1]):
                raise InputError("the last row of affine is not 0 0 0 1")
            self._spacing = np.linalg.norm(matrix[:3, :3], axis=0)
            self._origin = matrix[:3, 3].copy()
            self._direction = matrix[:3, :3] / np.where(self._spacing > 0, self._spacing, 1)
        else:
            raise InputError("affine stands for spacing, origin and direction: give either")
        if space == "RAS":
            self._origin = _LPS_TO_RAS @ self._origin
            self._direction = _LPS_TO_RAS @ self._direction
        elif space != "LPS":
            raise InputError(f"space is 'LPS' or 'RAS', not {space!r}")
        _marrow.check_geometry(self._array.shape, self._spacing, self._origin, self._direction)
        for values in (self._spacing, self._origin, self._direction):
            values.flags.writeable = False

    @property
    def array(self) -> np.ndarray:
        """The samples, shape (nz, ny, nx): the array that the volume was made of."""
        return self._array

    @property
    def spacing(self) -> np.ndarray:
        """The distances between samples along (i, j, k), in mm; read-only."""
        return self._spacing

    @property
    def origin(self) -> np.ndarray:
        """The position of ``array[0, 0, 0]``, LPS in mm; read-only."""
        return self._origin

    @property
    def direction(self) -> np.ndarray:
        """The unit vectors of the index axes (i, j, k) as columns, shape (3, 3); read-only."""
        return self._direction

    @property
    def affine(self) -> np.ndarray:
        """The map from (i, j, k, 1) to (x, y, z, 1), LPS in mm, shape (4, 4)."""
        affine = np.eye(4)
        affine[:3, :3] = self._direction * self._spacing
        affine[:3, 3] = self._origin
        return affine

    @property
    def shape(self) -> tuple[int, int, int]:
        """The numbers of samples (nz, ny, nx)."""
        return self._array.shape

    @property
    def dtype(self) -> np.dtype:
        """The type of the samples."""
        return self._array.dtype

    @property
    def info(self) -> Union[ScanInfo, None]:
        """What the scan was read from, or None."""
        return self._info

    @property
    def warnings(self) -> tuple[str, ...]:
        """What was unusual about the scan that was read, one line each."""
        return self._info.warnings if self._info else ()

    def __getitem__(self, key: tuple[slice, slice, slice]) -> Volume:
        """Return a part of the volume, in its place in space: ``volume[k0:k1, j0:j1, i0:i1]``.

        Like a slice of an array, it shares the samples, and may have steps other than 1.
        """
        if not (isinstance(key, tuple) and len(key) == 3 and all(isinstance(part, slice) for part in key)):
            raise InputError("a part of a volume has three slices: volume[k0:k1, j0:j1, i0:i1]")
        first, step = np.array([part.indices(size)[::2] for part, size in zip(key, self.shape)], float).T[:, ::-1]
        return Volume(
            self._array[key],
            spacing=self._spacing * np.abs(step),
            origin=self._origin + self._direction @ (self._spacing * first),
            direction=self._direction * np.sign(step),
            info=self._info,
        )

    def __repr__(self) -> str:
        nz, ny, nx = self.shape
        spacing = " x ".join(f"{value:g}" for value in self._spacing)
        return f"<marrow.Volume: {nx} x {ny} x {nz} samples of {self.dtype}, {spacing} mm>"

    def _native(self) -> _marrow.ArrayVolume:
        return _marrow.ArrayVolume(as_samples(self._array), self._spacing, self._origin, self._direction)


def _numbers(name: str, value: Any, shape: tuple[int, ...]) -> np.ndarray:
    try:
        return np.array(np.broadcast_to(np.asarray(value, float), shape) if np.ndim(value) == 0 and len(shape) == 1
                        else np.asarray(value, float).reshape(shape))
    except (TypeError, ValueError):
        raise InputError(f"{name} is not {' x '.join(map(str, shape))} numbers: {value!r}") from None
