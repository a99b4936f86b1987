"""Arrays from other packages, as NumPy arrays of a type that Marrow works on."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any, Optional

import numpy as np
from numpy.typing import NDArray

from ._marrow import InputError

Array = NDArray[Any]

# What `float` and NumPy raise for what is no number; the last is for integers that float64 cannot hold.
_NO_NUMBER = (TypeError, ValueError, OverflowError)


def refuse_path(source: Any) -> None:
    """Say what to do with a path where a volume is due."""
    if isinstance(source, (str, os.PathLike)):
        raise InputError(f"'{os.fspath(source)}' is a path and not a volume: read it with marrow.read")


def as_array(source: Any) -> Array:
    """Return `source` as a NumPy array, without a copy where it shares its memory.

    It takes arrays, and objects with `__array__`, `__array_interface__`, `__dlpack__` or the buffer protocol.
    """
    array = source if isinstance(source, np.ndarray) else _converted(source)
    _refuse_mask(array)
    return array


def _refuse_mask(values: Any) -> None:
    """Refuse a masked array, also one in a list, of which NumPy would make NaN."""
    if isinstance(values, np.ma.MaskedArray):
        raise InputError("a masked array has elements without a value: fill them first, with .filled(value)")
    if isinstance(values, (list, tuple)):
        for value in values:
            _refuse_mask(value)


def _converted(source: Any) -> Array:
    kind = f"{type(source).__module__}.{type(source).__qualname__}"
    try:
        array: Array = np.asanyarray(source)  # which keeps a mask
        if array.dtype == object and array.ndim == 0 and hasattr(source, "__dlpack__"):
            array = np.from_dlpack(source)
    except (AttributeError, TypeError, ValueError, RuntimeError, BufferError) as error:
        raise InputError(f"a {kind} cannot be read as an array: {error}") from error
    if array.dtype == object:
        raise InputError(f"a {kind} cannot be read as an array of numbers")
    return array


def as_number(value: Any, name: str) -> float:
    """Return `value` as a number; text is none, nor is a complex number, of which NumPy would drop a part."""
    try:
        if not isinstance(value, (str, bytes, np.complexfloating)):
            return float(value)
    except _NO_NUMBER:
        pass
    raise InputError(f"{name} is a number, not {value!r}")


def as_numbers(values: Any) -> Optional[NDArray[np.float64]]:
    """Return a copy of `values` as an array of numbers, or None if they are none, as text. A mask is refused."""
    _refuse_mask(values)
    try:
        given = np.asarray(values)
        # Of a complex number NumPy would drop a part, and of text it would make a number.
        return np.array(given, np.float64) if given.dtype.kind in "biufO" else None
    except _NO_NUMBER:
        return None


def sample_dtype(dtype: np.dtype[Any]) -> np.dtype[Any]:
    """Return the type that samples of this type are worked on as; often the same.

    It is uint8, int8, uint16, int16, int32, float32 or float64, in the byte order of the machine: uint8 for
    bool, float32 for float16, and float64 for uint32, int64 and uint64.
    """
    if dtype.kind == "b":
        return np.dtype(np.uint8)
    if dtype.kind == "f" and dtype.itemsize == 2:
        return np.dtype(np.float32)
    if dtype.kind in "ui" and dtype.itemsize == 8 or dtype.kind == "u" and dtype.itemsize == 4:
        return np.dtype(np.float64)
    if dtype.kind in "ui" or dtype.kind == "f" and dtype.itemsize <= 8:
        return dtype.newbyteorder("=")
    raise InputError(f"samples cannot be of type {dtype}: convert them to integers or to float32 or float64")


def as_samples(array: Array) -> Array:
    """Return `array` with its `sample_dtype`: a copy only where values or their bytes change."""
    dtype = sample_dtype(array.dtype)
    if array.dtype.kind == "b":
        return array.view(dtype)
    if array.dtype.kind in "ui" and array.dtype.itemsize == 8:
        exact = 2**53  # up to here, float64 holds every integer
        if array.size and (int(array.max()) > exact or int(array.min()) < -exact):
            raise InputError(f"a sample of type {array.dtype} is beyond 2^53, which float64 cannot hold exactly")
    return array.astype(dtype, copy=False)


def as_samples_of(source: Any, shape: Sequence[int], dtype: np.dtype[Any], name: str) -> Array:
    """Return a part of an array as samples, if it has the shape and the type that the array has let expect."""
    samples = as_samples(as_array(source))
    if samples.shape != tuple(shape):
        raise InputError(f"{name} has the shape {samples.shape} instead of {tuple(shape)}")
    if not np.can_cast(samples.dtype, dtype, "safe"):
        raise InputError(
            f"{name} has samples of type {samples.dtype}, and the array's dtype promises {dtype}: "
            "give an array whose dtype is that of its slices"
        )
    return samples.astype(dtype, copy=False)
