"""Random arrays of all types, strides, byte orders and sizes: the surface of a plain copy, or a clear error."""

import itertools
import os

import marrow
import numpy as np
from surfaces import is_same_surface

TYPES = ["?", "u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", "f2", "f4", "f8", "g", "F", "O", "U2"]
COUNT = int(os.environ.get("MARROW_RANDOM_ARRAYS", 7_500))


def random_array(random):
    """An array of samples from 0 to 9 with 1 to 4 axes, seldom other than 3."""
    axes = random.choice([3] * 20 + [1, 2, 4])
    shape = random.choice([0, 1, 2, 2, 2, 2, 3, 3, 4, 4, 5, 5, 7, 7], size=axes)
    steps = random.choice([1, 1, 1, -1, -1, 2, -3], size=axes)
    dtype = np.dtype(random.choice(TYPES)).newbyteorder(random.choice(["<", ">"]))
    room = [int(size) * abs(int(step)) + int(random.integers(3)) for size, step in zip(shape, steps)]
    values = random.integers(0, 10, room)
    with_nan = dtype.kind == "f" and random.random() < 0.3
    if with_nan:
        values = np.where(random.random(room) < 0.1, random.choice([np.nan, np.inf, -np.inf]), values)
    array = values.astype(dtype, order=random.choice(["C", "F"]))
    if dtype.kind in "iufb" and random.random() < 0.1:  # not aligned
        raw = np.empty(array.nbytes + 1, np.uint8)[1:].view(dtype).reshape(room)
        raw[...] = array
        array = raw
    if axes == 3 and random.random() < 0.05:
        array = np.broadcast_to(array[:1], room)
    array = array[tuple(slice(None, None, int(step)) for step in steps)]
    array = array[tuple(slice(0, int(size)) for size in shape)]
    array = array.transpose(random.permutation(axes))
    if random.random() < 0.2:
        array.flags.writeable = False
    return array


def is_supported(array):
    return array.ndim == 3 and (array.dtype.kind in "bui" or array.dtype.kind == "f" and array.dtype.itemsize <= 8)


def has_surface(array, isovalue, closed):
    values = array.astype(float)
    inside = np.isfinite(values) & (values >= isovalue)
    if closed:
        return inside.any()
    return min(array.shape) > 1 and inside.any() and not inside.all()


def outcome(array, isovalue, **options):
    try:
        return marrow.extract(array, isovalue, **options)
    except marrow.EmptySurface:
        return None


def test_random_arrays():
    random = np.random.default_rng(20)
    seen = dict(surfaces=0, empty=0, refused=0, copied=0)
    for _ in range(COUNT):
        array = random_array(random)
        isovalue = random.integers(0, 10) + random.choice([0, 0.5])
        options = dict(closed=bool(random.integers(2)), normals=bool(random.integers(2)), threads=1)
        described = f"{array.dtype} {array.shape} {array.strides} {options} {isovalue}"
        if not is_supported(array):
            try:
                outcome(array, isovalue, **options)
                raise AssertionError(f"not refused: {described}")
            except marrow.InputError as error:
                assert "\n" not in str(error) and str(error)
            seen["refused"] += 1
            continue
        volume = marrow.as_volume(array)
        mesh = outcome(volume, isovalue, **options)
        assert (mesh is not None) == has_surface(array, isovalue, options["closed"]), described
        seen["copied"] += volume._native().is_copy
        if mesh is None:
            seen["empty"] += 1
            continue
        seen["surfaces"] += 1
        assert (mesh.normals is not None) == options["normals"], described
        expected = outcome(np.array(array, np.float64, order="C"), isovalue, **options)
        assert is_same_surface(mesh, expected), described
    assert min(seen.values()) > COUNT / 50, seen


def test_arrays_of_every_small_shape():
    for shape in itertools.product(range(4), repeat=3):
        array = np.ones(shape, np.uint8)
        closed = outcome(array, 0.5, closed=True)
        assert (closed is None) == (array.size == 0)
        if closed is not None:
            assert closed.check().is_sound
        assert outcome(array, 0.5) is None
