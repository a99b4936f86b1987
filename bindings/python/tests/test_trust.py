"""Trust in files, and thin walls that are kept, as the command line does it."""

import os
import subprocess

import numpy as np
import pytest

import marrow
from marrow._isosurface import _stages

BUILD = os.environ.get("MARROW_BUILD")


@pytest.fixture(scope="module")
def scan(tmp_path_factory):
    """A frame of bone with a plate across it that is too thin for the isovalue of bone."""
    k, j, i = np.indices((24, 40, 41))
    within = (abs(k - 11.5) < 5) & (abs(j - 19.5) < 13) & (abs(i - 19.5) < 13)
    frame = within & ((abs(j - 19.5) > 8) | (abs(i - 19.5) > 8))
    plate = within & ~frame & (k == 12)
    noise = np.random.default_rng(2).normal(0, 4, k.shape)
    samples = (np.where(frame, 1200, np.where(plate, -100, -1000)) + noise).astype("<i2")
    path = tmp_path_factory.mktemp("scan") / "frame.nrrd"
    header = (
        "NRRD0004\ntype: int16\ndimension: 3\nsizes: 41 40 24\nspace: left-posterior-superior\n"
        "space directions: (0.9,0,0) (0,0.9,0) (0,0,1.2)\nspace origin: (10,20,30)\nendian: little\nencoding: raw\n\n"
    )
    path.write_bytes(header.encode() + samples.tobytes())
    return path


@pytest.fixture(scope="module")
def kept(scan):
    return marrow.extract(marrow.read(scan), "bone", closed=True, topology=True, trust=True, keep_thin=True)


@pytest.mark.skipif(not BUILD, reason="MARROW_BUILD names no build folder")
@pytest.mark.parametrize("extension", ["ply", "vtp", "glb", "stl"])
@pytest.mark.parametrize("keep_thin", [False, True])
def test_files_have_the_bytes_of_the_command_line(scan, kept, tmp_path, extension, keep_thin):
    mesh = kept if keep_thin else marrow.extract(marrow.read(scan), "bone", closed=True, topology=True, trust=True)
    ours, theirs = tmp_path / f"ours.{extension}", tmp_path / f"theirs.{extension}"
    mesh.write(ours, verify=True)
    command = [f"{BUILD}/bin/marrow", scan, "--type", "bone", "--topology", "--trust", "-o", theirs]
    command.append("--keep-thin" if keep_thin else "--no-alarm")
    subprocess.run(command, check=True, capture_output=True)
    assert ours.read_bytes() == theirs.read_bytes()


def orders_in_memory(array):
    """The same array in other orders in memory."""
    return [np.asfortranarray(array), array[::-1].copy()[::-1], array[:, :, ::-1].copy()[:, :, ::-1]]


def test_the_noise_does_not_depend_on_the_order_in_memory():
    rng = np.random.default_rng(4)
    rows = rng.normal(0, 20, (15, 49, 1)) + rng.normal(0, 10, (15, 49, 49))
    samples = np.where(np.arange(49) < 10, -1000, rows + 50).astype(np.float32)
    expected = marrow.extract(samples, -400, trust=True).trust.noise
    for other in orders_in_memory(samples):
        assert marrow.extract(other, -400, trust=True).trust.noise == expected


def test_resampling_does_not_depend_on_the_order_in_memory():
    samples = np.random.default_rng(5).normal(size=(10, 9, 8)).astype(np.float32)
    expected = marrow.resample_isotropic(samples, 4)
    for other in orders_in_memory(samples):
        resampled = marrow.resample_isotropic(other, 4)
        assert np.array_equal(resampled.array, expected.array)
        assert np.array_equal(resampled.origin, expected.origin)


@pytest.mark.parametrize("false", [False, np.False_])
def test_false_cancels_where_there_are_no_walls_to_keep(false):
    ball = np.fromfunction(lambda k, j, i: 8 - np.hypot(np.hypot(i - 12, j - 12), k - 12), (25, 25, 25))
    answers = lambda fraction: false if fraction > 0.6 else None  # noqa: E731
    with pytest.raises(marrow.Cancelled):
        marrow.extract(ball, 0.5, keep_thin=True, progress=answers)


def test_keeping_thin_walls_is_restoring_those_that_are_found(scan, kept):
    volume = marrow.read(scan)
    open_frame = marrow.extract(volume, "bone", closed=True)
    walls = marrow.find_thin_walls(volume, "bone", open_frame)
    expected = marrow.extract(walls.restore(), "bone", closed=True, topology=True)
    assert np.array_equal(kept.points, expected.points)
    assert np.array_equal(kept.triangles, expected.triangles)
    assert np.array_equal(kept.trust.near_thin_walls, walls.near(kept))
    assert kept.trust.near_thin_walls.any()
    assert not kept.trust.near_thin_walls.all()
    assert open_frame.measure().euler_characteristic == 0
    assert kept.measure().euler_characteristic == 2


def test_colours_are_blue_beside_restored_walls_and_otherwise_as_far_as_the_surface_moves(kept):
    trust = kept.trust
    assert trust.colours.shape == (len(kept.points), 3)
    near = trust.near_thin_walls
    assert (trust.colours[near] == (30, 90, 200)).all()
    moves_least, moves_most = trust.shift[~near].argmin(), trust.shift[~near].argmax()
    assert trust.colours[~near][moves_least].sum() > trust.colours[~near][moves_most].sum()


def test_progress_rises_through_all_stages():
    seen = []
    for stage in _stages(seen.append, 4):
        stage(0.0)
        stage(0.5)
    assert seen == [0, 0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875]
    assert next(_stages(lambda fraction: fraction < 0.1, 2))(0.5) is False
    assert list(_stages(None, 2)) == [None, None]


def test_meshes_with_and_without_trust_do_not_share_a_file(scan, kept, tmp_path):
    plain = marrow.extract(marrow.read(scan), "bone")
    with pytest.raises(marrow.InputError, match="arrays of different names"):
        marrow.write_meshes([kept, plain], tmp_path / "two.vtp")
    changed = marrow.Mesh(kept.points, kept.triangles)
    changed.trust = kept.trust
    changed.points = changed.points[:-1]
    changed.triangles = changed.triangles[(changed.triangles < len(changed.points)).all(axis=1)]
    with pytest.raises(marrow.InputError):
        changed.write(tmp_path / "changed.ply")
    assert not list(tmp_path.iterdir())
