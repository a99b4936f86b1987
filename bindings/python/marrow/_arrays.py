"""Arrays from other packages, as NumPy arrays of a type that Marrow works on."""

from __future__ import annotations

from typing import Any

import numpy as np

from ._marrow import InputError

_EXACT = 2**53  # up to here, float64 holds every integer


def as_array(source: Any) -> np.ndarray:
    """Return `source` as a NumPy array, without a copy where it shares its memory.

    It takes arrays, and objects with `__array__`, `__array_interface__`, `__dlpack__` or the buffer protocol.
    """
    if isinstance(source, np.ma.MaskedArray):
        raise InputError("a masked array has samples without a value: fill them first, with .filled(value)")
    if isinstance(source, np.ndarray):
        return source
    try:
        array = np.asarray(source)
        if array.dtype == object and array.ndim == 0 and hasattr(source, "__dlpack__"):
            array = np.from_dlpack(source)
    except (TypeError, ValueError, RuntimeError, BufferError) as error:
        raise InputError(f"{_name(source)} cannot be read as an array: {error}") from error
    if array.dtype == object:
        raise InputError(f"{_name(source)} cannot be read as an array of numbers")
    return array


def as_samples(array: np.ndarray) -> np.ndarray:
    """Return `array` with a sample type, in the byte order of the machine.

    That is uint8, int8, uint16, int16, int32, float32 or float64. Arrays of these types are returned as they
    are, and bool as a view of uint8. float16 becomes float32; uint32, int64 and uint64 become float64.
    """
    dtype = array.dtype
    if dtype == bool:
        return array.view(np.uint8)
    if dtype.kind == "f" and dtype.itemsize == 2:
        return array.astype(np.float32)
    if dtype.kind in "ui" and dtype.itemsize == 8:
        _check_exact(array)
    if dtype.kind in "ui" and (dtype.itemsize == 8 or (dtype.kind == "u" and dtype.itemsize == 4)):
        return array.astype(np.float64)
    if not (dtype.kind in "ui" or (dtype.kind == "f" and dtype.itemsize in (4, 8))):
        raise InputError(f"samples cannot be of type {dtype}: convert the array to integers or to float32 or float64")
    return array if dtype.isnative else array.astype(dtype.newbyteorder("="))


def _check_exact(array: np.ndarray) -> None:
    if array.size and (int(array.max()) > _EXACT or int(array.min()) < -_EXACT):
        raise InputError(f"a sample of type {array.dtype} is beyond 2^53, which float64 cannot hold exactly")


def _name(source: Any) -> str:
    return f"a {type(source).__module__}.{type(source).__qualname__}"
