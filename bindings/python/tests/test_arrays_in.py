"""Arrays of every kind become volumes, without copies where none is promised."""

import array as buffers
import copy
import pickle

import marrow
import numpy as np
import pytest
from surfaces import is_same_surface

TYPES = ["uint8", "int8", "uint16", "int16", "int32", "float32", "float64"]
LEVEL = 40.5


def address(volume):
    return volume._native().address


@pytest.fixture(scope="module")
def small(ball):
    return (ball[::2, ::2, ::2].clip(0) // 8).astype(np.uint8)


@pytest.mark.parametrize("dtype", TYPES)
def test_samples_of_every_type_are_used_where_they_are(small, dtype):
    array = small.astype(dtype)
    volume = marrow.Volume(array)
    assert address(volume) == array.ctypes.data
    assert is_same_surface(marrow.extract(volume, LEVEL), marrow.extract(small, LEVEL))


@pytest.mark.parametrize("axis", range(3))
def test_an_axis_of_one_sample_stays_where_it_is(ball, axis):
    """NumPy gives a new axis the stride 0, which is that of no neighbour."""
    slice_ = ball[12]
    view = slice_[tuple(np.newaxis if a == axis else slice(None) for a in range(3))]
    mesh = marrow.extract(view, LEVEL, closed=True)
    expected = marrow.extract(np.ascontiguousarray(slice_.reshape(view.shape)), LEVEL, closed=True)
    assert np.array_equal(mesh.points, expected.points)
    assert np.array_equal(mesh.triangles, expected.triangles)


def test_more_threads_than_the_machine_has_are_as_many_as_it_has(ball):
    one = marrow.marching_cubes(ball, LEVEL, threads=1)
    many = marrow.marching_cubes(ball, LEVEL, threads=1_000_000)
    assert all(np.array_equal(a, b) for a, b in zip(one, many))


@pytest.mark.parametrize("order", [(0, 1, 2), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0)])
@pytest.mark.parametrize("flips", range(8))
def test_no_axis_order_and_no_flip_copies_or_moves_samples(ball, order, flips):
    view = np.transpose(ball, order)[tuple(slice(None, None, -1 if flips >> axis & 1 else 1) for axis in range(3))]
    geometry = dict(spacing=(0.5, 1, 2), origin=(10, 20, 30), direction=[[0, 0, 1], [1, 0, 0], [0, 1, 0]])
    volume = marrow.Volume(view, **geometry)
    assert volume.array is view
    assert not volume._native().is_copy
    assert address(volume) == ball.ctypes.data
    copy = marrow.Volume(np.ascontiguousarray(view), **geometry)
    mesh = marrow.extract(volume, 300.5)
    assert is_same_surface(mesh, marrow.extract(copy, 300.5))
    # Normals point away from the bright inside, whichever way the axes run.
    out = mesh.points - mesh.points.mean(axis=0)
    assert np.all(np.sum(out * mesh.normals, axis=1) > 0)
    assert mesh.measure().volume > 0


@pytest.mark.parametrize(
    "cut",
    [
        np.s_[3:-3, 3:-3, 3:-3],
        np.s_[1::2, ::3, 3:],
        np.s_[::-2, 4:, -2:3:-1],
        np.s_[:, ::5],
        np.s_[13:14, 15:16],
        np.s_[:, 14:15, 2:19],
        np.s_[9:10, :, ::-1],
        np.s_[:, :, 15:16],
    ],
)
@pytest.mark.parametrize("order", [(0, 1, 2), (2, 0, 1), (1, 2, 0)])
def test_crops_and_steps_between_rows_are_not_copied(ball, cut, order):
    view = np.transpose(ball[cut], order)
    volume = marrow.Volume(view)
    assert not volume._native().is_copy
    low, high = np.byte_bounds(view)
    assert address(volume) == low
    closed = marrow.extract(volume, 300.5, closed=True)
    assert is_same_surface(closed, marrow.extract(np.ascontiguousarray(view), 300.5, closed=True))
    assert marrow.otsu(view) == marrow.otsu(np.ascontiguousarray(view))


def test_steps_along_rows_are_copied(ball):
    view = ball[:, :, ::2]
    assert marrow.Volume(view)._native().is_copy
    assert is_same_surface(marrow.extract(view, 300.5), marrow.extract(np.ascontiguousarray(view), 300.5))


def test_repeated_samples_are_copied(ball):
    view = np.broadcast_to(ball[13], ball.shape)
    assert marrow.Volume(view)._native().is_copy
    assert is_same_surface(marrow.extract(view, 300.5), marrow.extract(np.ascontiguousarray(view), 300.5))


def test_bool_is_viewed_and_not_copied(ball):
    inside = ball >= 301
    volume = marrow.Volume(inside)
    assert address(volume) == inside.ctypes.data
    assert is_same_surface(marrow.extract(volume, 0.5), marrow.extract(inside.astype(np.float32), 0.5))


@pytest.mark.parametrize("dtype", ["float16", "uint32", "int64", "uint64", ">i2", ">u2", ">f4", ">f8", ">i8"])
def test_other_types_and_byte_orders_give_the_is_same_surface(small, dtype):
    assert is_same_surface(marrow.extract(small.astype(dtype), LEVEL), marrow.extract(small, LEVEL))


@pytest.mark.parametrize("dtype", ["int64", "uint64"])
def test_integers_that_float64_cannot_hold_are_refused(dtype):
    array = np.zeros((3, 3, 3), dtype)
    array[1, 1, 1] = 2**53 + 1
    with pytest.raises(marrow.InputError, match="2\\^53"):
        marrow.extract(array, 1)


@pytest.mark.parametrize("dtype", ["complex64", "longdouble", "M8[s]", "U3", "O", [("a", "i2"), ("b", "i2")]])
def test_what_is_no_sample_is_refused(dtype):
    with pytest.raises(marrow.InputError, match="type|numbers"):
        marrow.Volume(np.zeros((3, 3, 3), dtype))


@pytest.mark.parametrize("shape", [(), (3,), (3, 3), (1, 3, 3, 3)])
def test_other_than_three_axes_are_refused(shape):
    with pytest.raises(marrow.InputError, match="three axes"):
        marrow.Volume(np.zeros(shape))


def test_a_path_is_read_before_it_is_extracted(tmp_path):
    file = tmp_path / "head.nii"
    for path in (file, str(file)):
        with pytest.raises(marrow.InputError, match=r"head.nii' is a path and not a volume: read it with marrow.read$"):
            marrow.extract(path, 0)


def test_masked_arrays_are_refused(ball, tmp_path):
    masked = np.ma.masked_less(ball, 0)
    for source in (masked, Convertible(masked)):
        with pytest.raises(marrow.InputError, match="filled"):
            marrow.extract(source, 300.5)
        with pytest.raises(marrow.InputError, match="filled"):
            marrow.marching_cubes(source, 300.5)
    with pytest.raises(marrow.InputError, match="filled"):
        marrow.extract_to_file(Slices(masked), 300.5, tmp_path / "surface.ply")
    numbers = np.ma.array([1, 2, 3], mask=[False, True, False])
    for values in (numbers, list(numbers)):
        for call in (lambda: marrow.sweep(ball, values), lambda: marrow.Volume(ball, spacing=values)):
            with pytest.raises(marrow.InputError, match="filled"):
                call()


@pytest.mark.parametrize("dtype", ["int16", "float32"])
def test_slices_of_another_type_than_that_of_the_array_are_refused(ball, tmp_path, dtype):
    source = Slices(ball.astype(np.float64))
    source.dtype = np.dtype(dtype)
    with pytest.raises(marrow.InputError, match=rf"the part \[0:\d+\] .* float64, .* {dtype}: give an array"):
        marrow.extract_to_file(source, 300.5, tmp_path / "surface.ply")


def test_the_traceback_of_an_error_keeps_no_memory_of_the_work(ball, tmp_path):
    """Debuggers, and pytest itself, would read it after it is gone."""
    source = Slices(ball)
    source.shape = (30, 31, 33)
    with pytest.raises(marrow.InputError, match="shape") as error:
        marrow.extract_to_file(source, 300.5, tmp_path / "surface.ply")
    kept = [value for entry in error.traceback for value in entry.frame.f_locals.values()]
    arrays = [value for value in kept if isinstance(value, np.ndarray)]
    assert arrays and all(np.shares_memory(array, ball) for array in arrays)


@pytest.mark.parametrize("source", [None, "scan.nii", object(), [[1, 2], [3]]])
def test_what_is_no_array_is_refused(source):
    with pytest.raises(marrow.InputError):
        marrow.Volume(source)


class Interface:
    """An object with nothing but `__array_interface__`."""

    def __init__(self, array):
        self.__array_interface__ = array.__array_interface__
        self.array = array


class Dlpack:
    """An object with nothing but DLPack, such as a tensor."""

    def __init__(self, array):
        self.array = array

    def __dlpack__(self, stream=None):
        return self.array.__dlpack__()

    def __dlpack_device__(self):
        return self.array.__dlpack_device__()


class Convertible:
    """An object with nothing but `__array__`."""

    def __init__(self, array):
        self.array = array

    def __array__(self, dtype=None):
        return self.array


class Slices(Convertible):
    """The same with slices, which are computed when they become arrays, as Dask's are."""

    def __init__(self, array):
        super().__init__(array)
        self.shape, self.dtype = array.shape, array.dtype

    def __getitem__(self, key):
        return Slices(self.array[key])


@pytest.mark.parametrize("kind", [Interface, Dlpack, Convertible, memoryview])
def test_the_protocols_of_arrays_share_memory(ball, kind):
    volume = marrow.Volume(kind(ball))
    assert address(volume) == ball.ctypes.data
    assert is_same_surface(marrow.extract(volume, 300.5), marrow.extract(ball, 300.5))


def test_a_buffer_shares_memory(ball):
    buffer = buffers.array("h", ball.tobytes())
    volume = marrow.Volume(memoryview(buffer).cast("B").cast("h", ball.shape))
    assert address(volume) == buffer.buffer_info()[0]
    assert is_same_surface(marrow.extract(volume, 300.5), marrow.extract(ball, 300.5))


def test_read_only_arrays_are_used_where_they_are(ball):
    array = ball.copy()
    array.flags.writeable = False
    assert address(marrow.Volume(array)) == array.ctypes.data
    assert is_same_surface(marrow.extract(array, 300.5), marrow.extract(ball, 300.5))


def test_a_part_stays_at_its_place(ball):
    volume = marrow.Volume(ball, spacing=(1, 2, 3), origin=(5, 6, 7))
    whole = marrow.extract(volume, 300.5)
    assert is_same_surface(marrow.extract(volume[2:-2, 1:-1, 3:-3], 300.5), whole)
    assert is_same_surface(marrow.extract(volume[::-1, :, ::-1], 300.5), whole)
    part = volume[4::2, :, 9:2:-3]
    assert np.shares_memory(part.array, ball)
    assert np.allclose(part.affine @ [1, 2, 3, 1], volume.affine @ [9 - 3, 2, 4 + 6, 1])


@pytest.mark.parametrize("copied", [lambda volume: pickle.loads(pickle.dumps(volume)), copy.copy, copy.deepcopy])
def test_the_geometry_of_copies_is_read_only(ball, copied):
    volume = copied(marrow.Volume(ball, spacing=(1, 2, 3), origin=(4, 5, 6)))
    assert volume.spacing.tolist() == [1, 2, 3] and volume.origin.tolist() == [4, 5, 6]
    for values in (volume.spacing, volume.origin, volume.direction):
        with pytest.raises(ValueError, match="read-only"):
            values[0] = 7


def test_nan_is_outside(ball):
    array = ball.astype(np.float32)
    array[13, 14, 15] = np.nan
    with_hole = marrow.extract(array, 300.5)
    assert with_hole.measure().components == 2
    assert np.isfinite(with_hole.points).all()


def test_affine_and_its_parts_say_the_same(ball):
    direction = np.array([[0, 0, 1], [1, 0, 0], [0, -1, 0]], float)
    a = marrow.Volume(ball, spacing=(1, 2, 3), origin=(4, 5, 6), direction=direction)
    b = marrow.Volume(ball, affine=a.affine)
    assert np.array_equal(a.affine, b.affine)
    assert np.array_equal(b.spacing, (1, 2, 3))
    ras = marrow.Volume(ball, affine=np.diag([-1, -1, 1, 1]) @ a.affine, space="RAS")
    assert np.array_equal(ras.affine, a.affine)


@pytest.mark.parametrize(
    "geometry",
    [
        dict(spacing=(1, 0, 1)),
        dict(spacing=(1, -1, 1)),
        dict(spacing=(1, 1)),
        dict(spacing="wide"),
        dict(spacing=(1, np.nan, 1)),
        dict(origin=(0, 0, np.inf)),
        dict(direction=np.ones((3, 3))),
        dict(direction=2 * np.eye(3)),
        dict(direction=np.ones((3, 3)) / np.sqrt(3)),
        dict(affine=np.eye(3)),
        dict(affine=np.zeros((4, 4))),
        dict(affine=np.eye(4), spacing=(1, 1, 1)),
        dict(space="MNI"),
    ],
)
def test_bad_geometry_is_refused(ball, geometry):
    with pytest.raises(marrow.InputError):
        marrow.Volume(ball, **geometry)
