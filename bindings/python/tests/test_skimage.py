"""marrow.marching_cubes against scikit-image 0.19, and against its own promises."""

import itertools
import os
import subprocess
import sys
import tarfile
from pathlib import Path

import marrow
import numpy as np
import pytest

measure = pytest.importorskip("skimage.measure")

SPACINGS = [(1.0, 1.0, 1.0), (2.0, 1.0, 0.5)]


def ball(shape=(24, 20, 28), dtype=np.float32):
    k, j, i = np.ogrid[: shape[0], : shape[1], : shape[2]]
    distance = np.sqrt((k - 11.2) ** 2 + (j - 9.7) ** 2 + (i - 13.4) ** 2)
    return (100 - 13 * distance).astype(dtype)


def noise(seed, dtype=np.float32):
    samples = np.random.default_rng(seed).normal(size=(9, 8, 11))
    return (samples * 40 + 100).astype(dtype)


def edges(verts, spacing):
    """The edge of the grid on which each point lies: its first sample, and its axis."""
    index = verts / np.asarray(spacing)
    axis = np.abs(index - np.round(index)).argmax(axis=1)
    first = np.round(index)
    rows = np.arange(len(verts))
    first[rows, axis] = np.floor(index[rows, axis])
    return np.column_stack([first, axis]).astype(int)


def in_order(verts, spacing):
    """The order of points by their edges."""
    return np.lexsort(edges(verts, spacing).T)


def apart_from_samples(verts, spacing):
    """Points closer to a sample than 1/1024 of an edge, moved to this distance: Marrow keeps them distinct."""
    edge = edges(verts, spacing)
    rows = np.arange(len(verts))
    first, axis = edge[rows, edge[:, 3]], edge[:, 3]
    index = verts / np.asarray(spacing)
    index[rows, axis] = first + np.clip(index[rows, axis] - first, 1 / 1024, 1 - 1 / 1024)
    return index * np.asarray(spacing)


def signed_volume(verts, faces):
    a, b, c = (verts[faces[:, corner]].astype(float) for corner in range(3))
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6


def off_the_grid(verts, spacing):
    """Whether points lie on no edge of the grid: scikit-image adds points in the middle of ambiguous cells."""
    index = verts / np.array(spacing)
    return (np.abs(index - np.round(index)) > 2e-4).sum(axis=1) > 1


def assert_same(ours, theirs, spacing):
    """The same points on the same edges, one to one, with the same values."""
    verts, _, _, values = theirs
    on_edges = ~off_the_grid(verts, spacing)
    verts, values = verts[on_edges], values[on_edges]
    assert len(ours.verts) == len(verts)
    a, b = in_order(ours.verts, spacing), in_order(verts, spacing)
    assert np.array_equal(edges(ours.verts[a], spacing), edges(verts[b], spacing))
    tolerance = max(1e-5, 2e-7 * verts.max())  # two roundings of float32
    assert np.abs(ours.verts[a] - apart_from_samples(verts, spacing)[b]).max() <= tolerance
    np.testing.assert_allclose(ours.values[a], values[b], rtol=1e-6)


def axis_orders(array):
    for order in itertools.permutations(range(3)):
        yield np.asarray(array.transpose(order), order="C").transpose(np.argsort(order))


@pytest.mark.parametrize("spacing", SPACINGS)
@pytest.mark.parametrize("dtype", [np.uint8, np.int16, np.float32, np.float64, np.int64])
def test_points_and_values_of_random_volumes_are_the_same(dtype, spacing):
    for seed in range(20):
        volume = noise(seed, dtype)
        theirs = measure.marching_cubes(volume, 100.5, spacing=spacing)
        for array in axis_orders(volume):
            ours = marrow.marching_cubes(array, 100.5, spacing=spacing)
            assert_same(ours, theirs, spacing)


def test_the_classic_method_has_as_many_faces():
    for seed in range(20):
        theirs = measure.marching_cubes(noise(seed), 100.5, method="lorensen")
        ours = marrow.marching_cubes(noise(seed), 100.5, method="lorensen")
        assert_same(ours, theirs, (1, 1, 1))
        assert len(ours.faces) == pytest.approx(len(theirs[1]), rel=0.02)


@pytest.mark.parametrize("gradient_direction", ["descent", "ascent"])
@pytest.mark.parametrize("spacing", SPACINGS)
@pytest.mark.parametrize("sign", [1, -1])
def test_a_ball_has_the_same_triangles_and_winding(sign, spacing, gradient_direction):
    arguments = {"spacing": spacing, "gradient_direction": gradient_direction}
    theirs = measure.marching_cubes(sign * ball(), sign * 10.5, **arguments)
    for array in axis_orders(sign * ball()):
        ours = marrow.marching_cubes(array, sign * 10.5, **arguments)
        assert_same(ours, theirs, spacing)
        assert len(ours.faces) == len(theirs[1])
        a, b = signed_volume(ours.verts, ours.faces), signed_volume(theirs[0], theirs[1])
        assert a == pytest.approx(b, rel=1e-3)
        assert np.sign(a) == (-sign if gradient_direction == "descent" else sign)
        if spacing == (1.0, 1.0, 1.0):
            a, b = in_order(ours.verts, spacing), in_order(theirs[0], spacing)
            assert np.einsum("ij,ij->i", ours.normals[a], theirs[2][b]).min() > 0.99


def test_normals_are_at_right_angles_to_the_surface_at_any_spacing():
    spacing = np.array([2.0, 1.0, 0.5])
    k, j, i = np.ogrid[:30, :60, :120]
    centre = np.array([29.1, 30.2, 29.7])
    distance = np.sqrt((2 * k - centre[0]) ** 2 + (j - centre[1]) ** 2 + (0.5 * i - centre[2]) ** 2)
    ours = marrow.marching_cubes(-distance, -20.0, spacing=spacing)
    theirs = measure.marching_cubes(-distance, -20.0, spacing=tuple(spacing))

    def degrees_off(verts, normals):
        radial = (verts - centre) / np.linalg.norm(verts - centre, axis=1)[:, None]
        return np.degrees(np.arccos(np.clip(np.einsum("ij,ij->i", radial, normals), -1, 1)))

    assert degrees_off(ours.verts, ours.normals).max() < 0.2
    assert degrees_off(theirs[0], theirs[2]).max() > 30


def test_results_are_contiguous_and_have_the_types_of_scikit_image():
    for spacing in SPACINGS:
        result = marrow.marching_cubes(ball(), 10.5, spacing=spacing)
        verts, faces, normals, values = result
        assert [array.dtype for array in result] == [np.float32, np.int32, np.float32, np.float32]
        assert verts.shape == normals.shape == (len(values), 3) and faces.shape[1] == 3
        assert all(array.flags.c_contiguous and array.flags.writeable for array in result)
    assert result.verts is verts and result.values is values


def test_the_default_level_is_the_middle():
    for volume in (ball(), ball(dtype=np.int16), ball() > 10):
        theirs = measure.marching_cubes(volume.astype(np.float32))
        assert_same(marrow.marching_cubes(volume), theirs, (1, 1, 1))


def test_the_default_level_does_not_overflow():
    samples = np.full((4, 4, 4), 1e308)
    samples[1:3, 1:3, 1:3] = 1.7e308
    assert np.array_equal(marrow.marching_cubes(samples).verts, marrow.marching_cubes(samples, 1.35e308).verts)


def test_a_mask_with_a_mask_is_refused():
    mask = np.ma.masked_array(np.ones((4, 4, 4), bool), False)
    with pytest.raises(marrow.InputError, match="filled"):
        marrow.marching_cubes(np.arange(64).reshape(4, 4, 4), 20.5, mask=mask)


def test_without_finite_samples_the_level_must_be_given():
    volume = ball()
    volume[0, 0, 0] = np.nan
    with pytest.raises(ValueError, match="give the level"):
        marrow.marching_cubes(volume)
    assert len(marrow.marching_cubes(volume, 10.5).verts) > 0


@pytest.mark.parametrize("topology", [False, True])
@pytest.mark.parametrize("dtype", [np.float16, np.float32, np.float64])
@pytest.mark.parametrize("level", [-79, 0, 49])
def test_infinite_samples_are_on_their_side_of_the_level(level, dtype, topology):
    volume = ball(dtype=dtype)
    volume[volume > 50], volume[volume < -80] = np.inf, -np.inf
    given = volume.copy()
    theirs = measure.marching_cubes(volume.astype(np.float32), level)[0]
    ours = marrow.marching_cubes(volume, level, topology=topology)
    assert np.array_equal(volume, given)
    assert len(ours.verts) == len(theirs)
    distance = np.abs(ours.verts[:, None] - theirs).max(axis=2)  # points keep 1/1024 of an edge away from samples
    assert distance.min(axis=1).max() < 1.01 / 1024 and distance.min(axis=0).max() < 1.01 / 1024
    out = ours.verts - np.array([11.2, 9.7, 13.4])
    assert np.isfinite(ours.normals).all() and (np.einsum("ij,ij->i", ours.normals, out) > 0).all()


@pytest.mark.parametrize("dtype", [np.uint8, np.int16, np.float32])
def test_samples_that_equal_the_level_are_outside_and_leave_no_hole(dtype):
    """scikit-image puts all points around such a sample at the sample itself, and so makes faces without area."""
    volume = np.random.default_rng(5).integers(0, 4, (14, 12, 13)).astype(dtype)
    theirs = measure.marching_cubes(volume, 1, method="lorensen")
    ours = marrow.marching_cubes(volume, 1)
    assert len(ours.verts) == len(theirs[0])
    # One to one: each point has one of the other kind at most 1/1024 of an edge away.
    distance = np.abs(ours.verts[:, None] - theirs[0]).max(axis=2)
    assert distance.min(axis=1).max() < 1.01 / 1024 and distance.min(axis=0).max() < 1.01 / 1024
    closed = marrow.marching_cubes(volume, 1, closed=True)
    edges = np.sort(closed.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    assert set(np.unique(edges, axis=0, return_counts=True)[1]) <= {2, 4}
    corners = closed.verts[closed.faces]
    assert not (corners == np.roll(corners, 1, axis=1)).all(axis=2).any()


@pytest.mark.parametrize("spacing", SPACINGS)
@pytest.mark.parametrize("step", [2, 3, 5])
def test_steps_take_each_nth_sample_at_its_position(step, spacing):
    theirs = measure.marching_cubes(ball(), 10.5, spacing=spacing, step_size=step)
    ours = marrow.marching_cubes(ball(), 10.5, spacing=spacing, step_size=step)
    assert_same(ours, theirs, np.array(spacing) * step)
    sliced = marrow.marching_cubes(ball()[::step, ::step, ::step], 10.5, spacing=np.array(spacing) * step)
    assert all(np.array_equal(a, b) for a, b in zip(ours, sliced))


def test_closed_surfaces_have_no_border():
    volume = noise(3)
    result = marrow.marching_cubes(volume, 100.5, closed=True)
    edges = result.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    assert {tuple(edge) for edge in edges} == {tuple(edge[::-1]) for edge in edges}


def test_snapping_merges_points_and_keeps_the_place():
    plain, snapped = (marrow.marching_cubes(ball(), 10.5, snap=snap) for snap in (0, 0.3))
    assert len(snapped.verts) < 0.8 * len(plain.verts) and len(snapped.values) == len(snapped.verts)
    assert signed_volume(*snapped[:2]) == pytest.approx(signed_volume(*plain[:2]), rel=0.01)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"volume": np.zeros((4, 4))}, "three axes"),
        ({"volume": np.zeros((1, 4, 4))}, "at least 2 samples"),
        ({"volume": "text"}, "path"),
        ({"volume": ball().astype(complex)}, "complex"),
        ({"level": 1000.0}, "outside the range of the samples, -"),
        ({"level": -1000.0}, "outside the range"),
        ({"level": np.nan}, ""),
        ({"spacing": (1, 1)}, "spacing is not 3 numbers: .1, 1."),
        ({"spacing": (1, 1, 0)}, "spacing along axis 2 is 0"),
        ({"spacing": (-1, 1, 1)}, "spacing along axis 0 is -1"),
        ({"spacing": (1, "a", 1)}, "spacing along axis 1 is a number, not 'a'"),
        ({"step_size": 0}, "at least 1"),
        ({"gradient_direction": "up"}, "'descent' or 'ascent', not 'up'"),
        ({"method": "_lorensen"}, "'lewiner' or 'lorensen', not '_lorensen'"),
        ({"mask": np.ones((3, 3, 3), bool)}, "the mask has the shape"),
        ({"mask": np.ones((24, 20, 28), bool), "closed": True}, "neither closed nor snap"),
        ({"snap": 0.5}, "snap"),
    ],
)
def test_bad_arguments_are_value_errors(arguments, message):
    with pytest.raises(ValueError, match=message) as raised:
        marrow.marching_cubes(**{"volume": ball(), "level": 10.5, **arguments})
    assert isinstance(raised.value, marrow.InputError)


def test_no_surface_is_a_runtime_error_as_in_scikit_image():
    for function in (marrow.marching_cubes, measure.marching_cubes):
        with pytest.raises(RuntimeError):
            function(np.ones((4, 4, 4)), 1.0)
        with pytest.raises(RuntimeError):
            function(ball()[:3, :3, :3], step_size=4)
    with pytest.raises(marrow.EmptySurface, match="leaves a single sample"):
        marrow.marching_cubes(ball()[:3], 10.5, step_size=3, closed=True)
    with pytest.raises(marrow.EmptySurface, match="no surface"):
        marrow.marching_cubes(np.ones((4, 4, 4)))


def test_progress_ends_at_one_and_false_cancels():
    fractions = []
    marrow.marching_cubes(ball(), 10.5, progress=fractions.append)
    assert fractions == sorted(fractions)
    with pytest.raises(marrow.Cancelled):
        marrow.marching_cubes(np.tile(noise(1, np.uint8), (16, 18, 13)), 100.5, threads=1, progress=lambda _: False)


def test_the_result_does_not_depend_on_threads():
    one, two = (marrow.marching_cubes(ball((90, 80, 70)), 10.5, threads=threads) for threads in (1, 2))
    assert all(np.array_equal(a, b) for a, b in zip(one, two))


MEMORY = """
import re, sys
import marrow, numpy

def status(name):
    return int(re.search(name + r":\\s+(\\d+) kB", open("/proc/self/status").read())[1]) * 1024

n = int(sys.argv[2])
volume = numpy.empty((n, n, n), sys.argv[1])
j, i = numpy.ogrid[:n, :n]
for k in range(n):
    volume[k] = 1000 - 2048 / n * numpy.sqrt((k - n / 2 + 0.3) ** 2 + (j - n / 2 - 0.2) ** 2 + (i - n / 2 + 0.1) ** 2)
marrow.marching_cubes(volume[:32, :32, :32])  # loads what the first call needs
open("/proc/self/clear_refs", "w").write("5")  # the peak is now what is used now
before = status("VmRSS")
result = marrow.marching_cubes(volume.transpose(2, 0, 1)[:, ::-1], 400.5)
peak = status("VmHWM") - before
print((peak - sum(array.nbytes for array in result)) / volume.nbytes)
"""


# In less than 512^3 samples of int16, the large pages in which memory comes are too large a part.
@pytest.mark.parametrize("dtype, n", [("int16", 512), ("float32", 320)])
def test_memory_is_that_of_the_results_and_an_eighth_of_the_volume(dtype, n):
    command = [sys.executable, "-c", MEMORY, dtype, str(n)]
    output = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    assert float(output) <= 0.12


def cranium():
    path = Path("/usr/share/doc/invesalius-examples/examples/Cranium.inv3")
    if not path.exists():
        pytest.skip("Debian's package invesalius-examples is not installed")
    with tarfile.open(path) as archive:
        member = next(member for member in archive if member.name.endswith("matrix.dat"))
        return np.frombuffer(archive.extractfile(member).read(), "<i2").reshape(108, 256, 256), (1.5, 0.957, 0.957), 225.5


def tooth():
    path = Path(os.environ.get("MARROW_TEST_DATA", ""), "tooth_sci/tooth_sci/tooth.raw")
    if not path.is_file():
        pytest.skip("MARROW_TEST_DATA names no folder with tooth_sci")
    return np.fromfile(path, ">u2").reshape(161, 94, 103), (1.0, 1.0, 1.0), 600.5


@pytest.mark.parametrize("scan", [cranium, tooth])
def test_real_scans_have_the_same_points(scan):
    samples, spacing, level = scan()
    theirs = measure.marching_cubes(samples, level, spacing=spacing)
    for array in itertools.islice(axis_orders(samples), 0, None, 2):
        ours = marrow.marching_cubes(array, level, spacing=spacing)
        assert_same(ours, theirs, spacing)
        assert len(ours.faces) == pytest.approx(len(theirs[1]), rel=0.01)
        ratio = signed_volume(ours.verts, ours.faces) / signed_volume(theirs[0], theirs[1])
        assert ratio == pytest.approx(1, rel=5e-3)  # ambiguous cells


def test_parts_of_arrays_give_the_values_of_their_copies():
    padded = np.random.default_rng(2).normal(size=(14, 20, 30))
    part = padded[2:12, 3:17:2, 4:23]
    ours, copied = marrow.marching_cubes(part, 0.1), marrow.marching_cubes(part.copy(), 0.1)
    assert all(np.array_equal(a, b) for a, b in zip(ours, copied))


def crossed_edges_of_masked_cells(volume, level, mask):
    """Brute force: for each crossed edge of a cell with eight True corners, the largest range of such a cell around it."""
    largest = {}
    for cell in np.ndindex(*(size - 1 for size in volume.shape)):
        box = tuple(slice(start, start + 2) for start in cell)
        if not mask[box].all():
            continue
        for axis in range(3):
            for corner in itertools.product((0, 1), repeat=3):
                if corner[axis]:
                    continue
                first = tuple(np.add(cell, corner))
                second = tuple(np.add(first, np.eye(3, dtype=int)[axis]))
                if (volume[first] > level) != (volume[second] > level):
                    edge = (*first, axis)
                    largest[edge] = max(largest.get(edge, 0), volume[box].max() - volume[box].min())
    return largest


@pytest.mark.parametrize("seed", range(12))
def test_a_mask_keeps_the_cells_with_eight_true_corners(seed):
    random = np.random.default_rng(seed)
    volume, mask = noise(seed, np.int16), random.random((9, 8, 11)) < 0.85
    spacing = SPACINGS[seed % 2]
    expected = crossed_edges_of_masked_cells(volume.astype(float), 100.5, mask)
    order = random.permutation(3)
    mask_in_another_order = np.asarray(mask.transpose(order), order="C").transpose(np.argsort(order))
    ours = marrow.marching_cubes(volume, 100.5, spacing=spacing, mask=mask_in_another_order)
    found = dict(zip(map(tuple, edges(ours.verts, spacing).tolist()), ours.values.tolist()))
    assert found == expected
    whole = marrow.marching_cubes(volume, 100.5, spacing=spacing)
    triangles = {tuple(map(tuple, face)) for face in whole.verts[whole.faces].tolist()}
    kept = {tuple(map(tuple, face)) for face in ours.verts[ours.faces].tolist()}
    assert kept < triangles
    cells = np.floor(ours.verts[ours.faces].mean(axis=1) / spacing).astype(int)
    assert all(mask[tuple(slice(start, start + 2) for start in cell)].all() for cell in cells)


def test_a_full_mask_changes_nothing_and_an_empty_one_leaves_nothing():
    for step in (1, 2):
        masked = marrow.marching_cubes(ball(), 10.5, step_size=step, mask=np.ones(ball().shape, bool))
        plain = marrow.marching_cubes(ball(), 10.5, step_size=step)
        assert all(np.array_equal(a, b) for a, b in zip(masked, plain))
    with pytest.raises(marrow.EmptySurface):
        marrow.marching_cubes(ball(), 10.5, mask=np.zeros(ball().shape, bool))
