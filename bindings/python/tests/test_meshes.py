"""Meshes: their arrays, how long these live, what is measured on them and done to them."""

import gc
import os
import subprocess
import sys
import weakref

import marrow
import numpy as np
import pytest


@pytest.fixture(scope="module")
def mesh(ball):
    return marrow.extract(marrow.Volume(ball, spacing=0.5), 300.5)


def test_arrays_are_plain(mesh):
    assert mesh.points.dtype == mesh.normals.dtype == np.float32
    assert mesh.triangles.dtype == np.int32
    for array in (mesh.points, mesh.normals, mesh.triangles):
        assert array.shape[1] == 3
        assert array.flags.c_contiguous and array.flags.writeable and array.flags.aligned


def test_a_mesh_of_its_own_arrays_shares_them(mesh):
    same = marrow.Mesh(mesh.points, mesh.triangles, mesh.normals)
    assert same.points is mesh.points
    assert same.triangles is mesh.triangles
    assert same.normals is mesh.normals


def test_arrays_outlive_volume_and_mesh(ball):
    volume = marrow.Volume(ball.copy())
    array = weakref.ref(volume.array)
    mesh = marrow.extract(volume, 300.5)
    expected = mesh.points[5:7, 1:].copy()
    part = mesh.points[5:7, 1:]
    del mesh, volume
    gc.collect()
    assert array() is None  # the surface does not hold the volume
    for _ in range(3):
        marrow.extract(ball, 300.5)  # would use freed memory
    assert np.array_equal(part, expected)


def test_a_change_of_the_arrays_changes_the_mesh(ball):
    mesh = marrow.extract(ball, 300.5)
    before = mesh.measure()
    mesh.points *= 2
    assert mesh.measure().volume == pytest.approx(8 * before.volume, rel=1e-5)
    mesh.triangles[:] = mesh.triangles[:, ::-1]
    assert mesh.measure().volume == pytest.approx(-8 * before.volume, rel=1e-5)


@pytest.mark.parametrize(
    ("points", "triangles", "normals"),
    [
        (np.zeros((3, 2)), [[0, 1, 2]], None),
        (np.zeros((3, 3)), [[0, 1, 3]], None),
        (np.zeros((3, 3)), [[0, 1, -1]], None),
        (np.zeros((3, 3)), [[0.0, 1.0, 2.0]], None),
        (np.zeros((3, 3)), [[0, 1]], None),
        (np.zeros((3, 3)), [[0, 1, 2]], np.zeros((2, 3))),
        (np.zeros((3, 3), complex), [[0, 1, 2]], None),
    ],
)
def test_bad_arrays_are_refused(points, triangles, normals):
    with pytest.raises(marrow.InputError):
        marrow.Mesh(points, triangles, normals)


@pytest.mark.parametrize("colour", [(255, 0, 128), (-0.1, 0, 0), (np.nan, 0, 0), (1, 0), (1, 0, 0, 1), "red"])
def test_colours_that_files_cannot_hold_are_refused(ball, tmp_path, colour):
    mesh = marrow.extract(ball, 300.5)
    with pytest.raises(marrow.InputError, match="colour is"):
        marrow.Mesh(mesh.points, mesh.triangles, colour=colour)
    mesh.colour = colour
    with pytest.raises(marrow.InputError, match="colour is"):
        mesh.write(tmp_path / "mesh.glb")


@pytest.mark.parametrize(
    "change",
    [
        lambda mesh: setattr(mesh, "points", mesh.points.astype(np.float64)),
        lambda mesh: setattr(mesh, "points", mesh.points[::2]),
        lambda mesh: setattr(mesh, "triangles", mesh.triangles[:, ::-1]),
        lambda mesh: setattr(mesh, "triangles", mesh.triangles.tolist()),
        lambda mesh: setattr(mesh, "normals", mesh.normals[:-1]),
        lambda mesh: mesh.triangles.__setitem__((7, 1), len(mesh.points)),
        lambda mesh: mesh.triangles.__setitem__((7, 1), -1),
    ],
)
@pytest.mark.parametrize("use", ["measure", "check", "smooth", "simplify", "keep_components"])
def test_arrays_that_no_longer_fit_are_refused(ball, change, use):
    mesh = marrow.extract(ball, 300.5)
    change(mesh)
    with pytest.raises(marrow.InputError):
        getattr(mesh, use)()


def test_an_extractor_never_writes_to_a_mesh_that_is_referenced(ball):
    extractor = marrow.IsosurfaceExtractor(ball)
    kept = extractor.extract(300.5)
    part, copy = kept.points[3:9], kept.points.copy()
    view = extractor.extract(100.5).triangles[:4]
    assert not np.shares_memory(view.base if view.base is not None else view, kept.triangles)
    triangles = view.copy()
    del kept
    for isovalue in range(0, 900, 50):
        extractor.extract(isovalue + 0.5)
    assert np.array_equal(part, copy[3:9])
    assert np.array_equal(view, triangles)


def test_an_extractor_uses_the_memory_of_the_last_mesh_again(ball):
    extractor = marrow.IsosurfaceExtractor(ball)
    address = extractor.extract(300.5).points.ctypes.data
    assert extractor.extract(400.5).points.ctypes.data == address


def test_an_extractor_gives_the_bytes_of_extract(ball):
    extractor = marrow.IsosurfaceExtractor(ball, closed=True, snap=0.3)
    for isovalue in (300.5, 700, -2000.5, 300.5):
        mesh, expected = extractor.extract(isovalue), marrow.extract(ball, isovalue, closed=True, snap=0.3)
        assert np.array_equal(mesh.points, expected.points)
        assert np.array_equal(mesh.triangles, expected.triangles)
        assert np.array_equal(mesh.normals, expected.normals)


def test_trust_is_exact_where_samples_are_linear():
    ramp = np.fromfunction(lambda k, j, i: 10.0 * i, (9, 10, 12), dtype=np.float32)  # 10 units per mm along x
    mesh = marrow.extract(ramp, 47, trust=True)
    assert mesh.trust.step == pytest.approx(6, rel=0.1)  # a tenth of the contrast
    np.testing.assert_allclose(mesh.trust.shift, mesh.trust.step / 10, rtol=1e-5)
    assert mesh.trust.shift.shape == (len(mesh.points),)
    assert mesh.trust.shifts.capped == 0
    assert marrow.extract(ramp, 47).trust is None


def test_trust_of_ct_is_for_100_hu():
    rng = np.random.default_rng(1)
    distance = np.linalg.norm(np.indices((48, 48, 48)) - 23.5, axis=0)
    tissue = np.clip(-1000 + 1040 * (distance < 22) + 1000 * (distance < 12), -1024, None)
    mesh = marrow.extract(marrow.gaussian_filter(tissue + rng.normal(0, 10, tissue.shape), 0.4), 500, trust=True)
    assert mesh.trust.step == 100
    assert 0 < mesh.trust.noise.lowest <= mesh.trust.noise.sigma <= mesh.trust.noise.highest < 15
    assert mesh.trust.noise_shifts.median < mesh.trust.shifts.median


def test_topology_keeps_a_wall_askew_in_one_piece():
    k, j, i = np.indices((12, 12, 12))
    wall = np.where(i - j == 3, 100, -50).astype(np.int16)
    plain, exact = (marrow.extract(wall, 0, closed=True, topology=topology) for topology in (False, True))
    assert plain.measure().components > 5
    assert exact.measure().components == 1
    extractor = marrow.IsosurfaceExtractor(wall, closed=True, topology=True)
    assert np.array_equal(extractor.extract(0).triangles, exact.triangles)
    with pytest.raises(marrow.InputError, match="topology"):
        marrow.extract(wall, 0, snap=0.3, topology=True)


def test_topology_is_the_same_as_of_scikit_image_and_in_files(tmp_path):
    k, j, i = np.indices((12, 12, 12))
    wall = np.where(i - j == 3, 100, -50).astype(np.int16)
    exact = marrow.extract(wall, 0, closed=True, topology=True)
    assert marrow.extract_to_file(wall, 0, tmp_path / "a.ply", closed=True, topology=True) == (
        len(exact.points),
        len(exact.triangles),
    )
    exact.write(tmp_path / "b.ply")
    assert (tmp_path / "a.ply").read_bytes() == (tmp_path / "b.ply").read_bytes()
    verts, faces, _, values = marrow.marching_cubes(wall, 0, closed=True, topology=True)
    assert faces.shape == exact.triangles.shape
    # No sample equals the level, so only the order of the axes differs.
    np.testing.assert_allclose(verts[:, ::-1], exact.points, atol=1e-5)
    assert np.all(values == 150)
    with pytest.raises(marrow.InputError, match="topology"):
        marrow.marching_cubes(wall, 0, snap=0.3, topology=True)


def test_a_preview_is_coarser_and_at_the_same_place(ball):
    volume = marrow.Volume(ball, spacing=(1, 2, 3), origin=(7, 8, 9))
    extractor = marrow.IsosurfaceExtractor(volume)
    fine, coarse = extractor.extract(300.5), extractor.extract(300.5, level=1)
    assert len(coarse.triangles) < len(fine.triangles) / 2
    assert fine.distance(coarse).max < 3
    with pytest.raises(marrow.InputError, match="level"):
        extractor.extract(300.5, level=31)


def test_an_extractor_keeps_its_array_alive(ball):
    array = ball.copy()
    extractor = marrow.IsosurfaceExtractor(array)
    alive = weakref.ref(array)
    del array
    gc.collect()
    assert alive() is not None
    assert len(extractor.extract(300.5).points) == len(marrow.extract(ball, 300.5).points)
    del extractor
    assert alive() is None


def test_an_empty_surface_is_an_error_but_not_for_a_slider(ball):
    with pytest.raises(marrow.EmptySurface, match="from -6372 to 1000"):
        marrow.extract(ball, 2000)
    with pytest.raises(RuntimeError):
        marrow.extract(np.full((4, 4, 4), np.nan), 0)
    empty = marrow.IsosurfaceExtractor(ball).extract(2000)
    assert empty.points.shape == empty.triangles.shape == (0, 3)
    assert empty.measure().triangles == 0


def test_meshes_outlive_the_interpreter():
    code = """
import marrow, numpy, threading
ball = numpy.fromfunction(lambda z, y, x: 1000 - (x - 50) ** 2 - (y - 50) ** 2 - (z - 50) ** 2, (100, 100, 100))
extractor = marrow.IsosurfaceExtractor(ball)
mesh = extractor.extract(10)
points = mesh.points[3:]
class Cycle: pass
cycle = Cycle(); cycle.self = cycle; cycle.mesh = mesh; cycle.extractor = extractor
working = threading.Barrier(4)
def work():
    marrow.extract(ball, 10)
    working.wait()
    try:
        while True:
            marrow.extract(ball, 10)
    except marrow.Cancelled:  # by the end of the interpreter
        pass
for _ in range(3):
    threading.Thread(target=work, daemon=True).start()
working.wait()
print(len(points))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stderr) == (0, "")
    assert int(done.stdout) > 1000


@pytest.mark.skipif(not os.path.isdir("/proc/self/task"), reason="threads are counted in /proc")
def test_measures_on_one_thread():
    code = """
import os
import marrow
import numpy as np
def threads():
    return len(os.listdir("/proc/self/task"))
z, y, x = np.mgrid[:40, :40, :40]
mesh = marrow.extract(np.float32(200 - (x - 20) ** 2 - (y - 20) ** 2 - (z - 20) ** 2), 0, threads=1)
before = threads()
one = mesh.measure(threads=1)
assert threads() == before
assert one.volume == mesh.measure().volume
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stderr) == (0, "")


def test_measures_of_a_ball():
    z, y, x = np.mgrid[:40, :40, :40]
    distance = np.sqrt((x - 19.6) ** 2 + (y - 19.7) ** 2 + (z - 19.8) ** 2)
    mesh = marrow.extract(marrow.Volume(-distance, spacing=0.5), -15)
    measures = mesh.measure()
    assert measures.volume == pytest.approx(4 / 3 * np.pi * 7.5**3, rel=0.01)
    assert measures.area == pytest.approx(4 * np.pi * 7.5**2, rel=0.01)
    assert (measures.components, measures.boundary_edges, measures.euler_characteristic) == (1, 0, 2)
    assert np.allclose(measures.lower, mesh.points.min(axis=0))
    assert np.median(mesh.mean_curvature()) == pytest.approx(1 / 7.5, rel=0.1)
    assert mesh.roughness(2).mean_curvature == pytest.approx(1 / 7.5, rel=0.2)
    check = mesh.check(min_wall=0.1)
    assert check.is_sound and check.genus == 0 and check.thinnest_wall is None
    assert mesh.check(min_wall=100).thin_triangles > 0
    assert sum(mesh.quality().angle_histogram) == 3 * len(mesh.triangles)


def test_steps_return_new_meshes(mesh):
    mesh.name, mesh.colour = "ball", (1.0, 0.5, 0.0)
    before = mesh.points.copy()
    smooth = mesh.smooth(30, bound=0.5 * np.eye(4))
    assert 0 < np.abs(smooth.points - mesh.points).max() <= 0.25 + 1e-6
    small = mesh.simplify(500)
    assert 0 < len(small.triangles) <= 500
    near = mesh.simplify(max_error=0.05)
    assert len(near.triangles) < len(mesh.triangles) and mesh.distance(near).max <= 0.05
    two = marrow.Mesh(
        np.concatenate([mesh.points, mesh.points / 4 + 100]),
        np.concatenate([mesh.triangles, mesh.triangles + len(mesh.points)]),
    )
    assert two.measure().components == 2
    assert two.keep_components(1).measure().components == 1
    assert two.keep_components(min_volume=mesh.measure().volume / 2).points.max() < 50
    assert np.array_equal(mesh.points, before)
    assert (smooth.name, smooth.colour) == (small.name, small.colour) == ("ball", (1.0, 0.5, 0.0))


@pytest.mark.parametrize("extension", ["stl", "ply", "obj", "vtp", "3mf", "glb", "ply.gz"])
def test_files_read_back(mesh, tmp_path, extension):
    path = tmp_path / f"ball.{extension}"
    mesh.write(path, verify=True)
    found = marrow.read_mesh(path)
    assert len(found.triangles) == len(mesh.triangles)
    assert np.allclose(found.points.min(axis=0), mesh.points.min(axis=0), rtol=1e-6)
    assert found.measure().volume == pytest.approx(mesh.measure().volume, rel=1e-5)


def test_verification_knows_that_3mf_leaves_out_triangles_with_equal_corners(mesh, tmp_path):
    more = marrow.Mesh(mesh.points, np.concatenate([[[0, 0, 1]], mesh.triangles]))
    more.write(tmp_path / "more.3mf", verify=True)
    assert len(marrow.read_mesh(tmp_path / "more.3mf").triangles) == len(mesh.triangles)


def test_verification_allows_for_the_steps_of_float32_in_metres(tmp_path):
    points = np.array([[0, 0, 0], [1, 0, 1e-42], [0, 1, 3e-44]], np.float32)
    marrow.Mesh(points, [[0, 1, 2]]).write(tmp_path / "tiny.glb", verify=True)


@pytest.mark.parametrize("shape", [(3,), (5, 5), (2, 3)])
def test_the_bound_of_smoothing_is_a_matrix(mesh, shape):
    with pytest.raises(marrow.InputError, match="bound has the shape"):
        mesh.smooth(bound=np.ones(shape))


def test_smoothing_keeps_to_its_limits(mesh):
    def moved(**limits):
        return np.linalg.norm(mesh.smooth(30, **limits).points - mesh.points, axis=1)

    assert 0 < moved(max_move=0.01).max() < 0.0101
    assert 0 < moved(pass_band=1.0).mean() < moved(pass_band=0.01).mean() / 2


def test_ras_negates_x_and_y_in_the_file_only(mesh, tmp_path):
    mesh.write(tmp_path / "ball.ply", space="RAS", verify=True)
    data = (tmp_path / "ball.ply").read_bytes()
    body = data[data.index(b"end_header\n") + 11 :]
    assert np.array_equal(np.frombuffer(body, "<f4", 3), mesh.points[0] * np.float32([-1, -1, 1]))
    assert np.array_equal(marrow.read_mesh(tmp_path / "ball.ply").points, mesh.points)


def test_several_meshes_share_a_file(mesh, tmp_path):
    other = marrow.Mesh(mesh.points + 20, mesh.triangles, name="second", colour=(0, 0, 1))
    marrow.write_meshes([mesh, other], tmp_path / "two.3mf", verify=True)
    assert marrow.read_mesh(tmp_path / "two.3mf").measure().components == 2
    with pytest.raises(marrow.InputError):
        marrow.write_meshes([mesh, other], tmp_path / "two.stl")
    with pytest.raises(marrow.InputError):
        marrow.write_meshes([], tmp_path / "none.3mf")
    assert [path.name for path in tmp_path.iterdir()] == ["two.3mf"]


@pytest.mark.parametrize("name", [5, b"bone", None, "\udcff"])
def test_names_that_files_cannot_hold_are_refused(mesh, tmp_path, name):
    with pytest.raises(marrow.InputError, match="name of a mesh"):
        marrow.Mesh(mesh.points, mesh.triangles, name=name)
    named = marrow.Mesh(mesh.points, mesh.triangles)
    named.name = name
    with pytest.raises(marrow.InputError, match="name of a mesh"):
        named.write(tmp_path / "named.obj")


@pytest.mark.parametrize("masked", ["points", "triangles", "normals"])
def test_masked_arrays_are_refused(mesh, masked):
    arrays = {"points": mesh.points, "triangles": mesh.triangles, "normals": mesh.normals}
    arrays[masked] = np.ma.masked_equal(arrays[masked], 0)
    with pytest.raises(marrow.InputError, match="filled"):
        marrow.Mesh(**arrays)


def test_errors_of_files(mesh, tmp_path):
    with pytest.raises(OSError):
        mesh.write(tmp_path / "missing" / "ball.stl")
    with pytest.raises(marrow.InputError):
        mesh.write(tmp_path / "ball.xyz")
    with pytest.raises(marrow.InputError, match="space"):
        mesh.write(tmp_path / "ball.stl", space="MNI")
    with pytest.raises(marrow.IoError):
        marrow.read_mesh(tmp_path / "ball.stl")
    assert not list(tmp_path.iterdir())


def test_notebooks_show_a_table(mesh):
    text = marrow.Mesh(mesh.points, mesh.triangles, name="<b>")._repr_html_()
    assert f"{len(mesh.triangles):,}" in text
    assert "&lt;b&gt;" in text
