"""Surfaces that the workers of a Dask cluster extract together have the bytes of the surface of the whole array."""

import contextlib
import json
import multiprocessing
import os
import signal
import threading
import time
from pathlib import Path

import marrow
import numpy as np
import pytest

pytest.importorskip("distributed")
zarr = pytest.importorskip("zarr")
import dask.array  # noqa: E402
import distributed  # noqa: E402
import marrow.dask  # noqa: E402
from marrow import _blocks, _marrow  # noqa: E402


@contextlib.contextmanager
def workers(count, folder):
    """Worker processes, which their nannies start again after a crash."""
    others = multiprocessing.active_children()
    try:
        # A cluster gives a worker up that is not back after a quarter of a minute, which may be too little when all
        # processors are busy; then tasks would wait for ever.
        with dask.config.set({"distributed.deploy.lost-worker-timeout": "10 minutes"}), distributed.LocalCluster(
            n_workers=count,
            threads_per_worker=1,
            processes=True,
            host="127.0.0.1",
            dashboard_address=None,
            local_directory=str(folder),
        ) as cluster, distributed.Client(cluster) as client:
            yield client
    finally:
        # Python waits at its end for processes that were asked to end. A worker that just starts may not hear it.
        for process in multiprocessing.active_children():
            if process not in others:
                process.kill()


@pytest.fixture(scope="module")
def client(tmp_path_factory):
    with workers(4, tmp_path_factory.mktemp("workers")) as client:
        yield client


def noise(rng, shape, dtype):
    """Few values, so that many samples equal the isovalue 2."""
    return rng.integers(0, 5, shape).astype(dtype)


def alternating_noise(rng, shape, dtype):
    """The same, but most neighbours are on different sides: surfaces with exact topology have points inside cells."""
    inside = np.indices(shape).sum(0) % 2 == (rng.random(shape) < 0.2)
    return np.where(inside, 2 + rng.integers(0, 3, shape), rng.integers(0, 2, shape)).astype(dtype)


def same_bytes(a, b):
    return all(
        x is y is None or x.dtype == y.dtype and x.tobytes() == y.tobytes()
        for x, y in ((a.points, b.points), (a.triangles, b.triangles), (a.normals, b.normals))
    )


def stored(tmp_path, samples, chunks):
    return zarr.array(samples, chunks=chunks, store=zarr.DirectoryStore(str(tmp_path / "samples.zarr")))


def image(folder, spacing, origin):
    """The folder of a stored array as an OME-Zarr image; spacing and origin are (x, y, z)."""
    axes = [{"name": name, "type": "space", "unit": "millimeter"} for name in "zyx"]
    steps = [
        {"type": "scale", "scale": list(reversed(spacing))},
        {"type": "translation", "translation": list(reversed(origin))},
    ]
    level = {"path": "samples.zarr", "coordinateTransformations": steps}
    zarr.open_group(str(folder), mode="a").attrs["multiscales"] = [{"version": "0.4", "axes": axes, "datasets": [level]}]
    return folder


OBLIQUE = {
    "spacing": (0.7, 0.9, 1.3),
    "origin": (-113.7, 41.3, 207.9),
    "direction": [[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, -1]],
}


@pytest.mark.parametrize("dtype", ["u1", "i1", "u2", "i2", "i4", "f4", "f8", ">i2", "u4", "?"])
def test_extract_has_the_bytes_of_the_whole(client, tmp_path, dtype):
    rng = np.random.default_rng(3)
    isovalue = 0.5 if dtype == "?" else 2
    for closed in (False, True):
        shape = rng.integers(2, 30, 3)
        samples = noise(rng, shape, dtype)
        source = zarr.array(samples, chunks=tuple(rng.integers(2, 9, 3)), store=zarr.TempStore(dir=str(tmp_path)))
        mesh = marrow.dask.extract(source, isovalue, closed=closed, blocks=rng.integers(3, 14, 3), **OBLIQUE)
        assert same_bytes(mesh, marrow.extract(marrow.Volume(samples, **OBLIQUE), isovalue, closed=closed))


@pytest.mark.parametrize("dtype", ["u1", "i1", "u2", "i2", "i4", "f4", "f8"])
def test_exact_topology_has_the_bytes_of_the_whole(client, tmp_path, dtype):
    rng = np.random.default_rng(11)
    for closed in (False, True):
        samples = alternating_noise(rng, rng.integers(9, 30, 3), dtype)
        volume = marrow.Volume(samples, **OBLIQUE)
        settings = {"closed": closed, "topology": True}
        whole = marrow.extract(volume, 2, **settings)
        assert len(whole.points) > 100 + len(marrow.extract(volume, 2, closed=closed).points)
        source = zarr.array(samples, chunks=tuple(rng.integers(2, 9, 3)), store=zarr.TempStore(dir=str(tmp_path)))
        mesh = marrow.dask.extract(source, 2, blocks=rng.integers(3, 14, 3), **settings, **OBLIQUE)
        assert same_bytes(mesh, whole)
        for name in ("surface.ply", "surface.stl"):
            whole.write(tmp_path / ("whole-" + name))
            blocks = rng.integers(3, 14, 3)
            size = marrow.dask.extract_to_file(source, 2, tmp_path / name, blocks=blocks, **settings, **OBLIQUE)
            assert size == (len(whole.points), len(whole.triangles))
            assert (tmp_path / name).read_bytes() == (tmp_path / ("whole-" + name)).read_bytes()


@pytest.mark.parametrize("kind", ["numpy", "dask", "zarr", "path"])
@pytest.mark.parametrize("name", ["surface.ply", "surface.stl"])
def test_files_have_the_bytes_of_the_whole(client, tmp_path, kind, name):
    rng = np.random.default_rng(4)
    for round in range(2):
        # Noise has thin walls, where writers turn normals outward.
        samples = noise(rng, rng.integers(9, 50, 3), ["i2", "u4"][round])
        sources = {
            "numpy": lambda: samples,
            "dask": lambda: dask.array.from_array(samples, chunks=tuple(rng.integers(3, 9, 3))),
            "zarr": lambda: stored(tmp_path / str(round), samples, tuple(rng.integers(3, 9, 3))),
            "path": lambda: stored(tmp_path / str(round), samples, tuple(rng.integers(3, 9, 3))),
        }
        blocks = [None, rng.integers(3, 24, 3)][round]
        space = ["RAS", "LPS"][round]
        source, geometry = sources[kind](), OBLIQUE
        if kind == "path":
            geometry = {"spacing": (0.7, 0.9, 1.3), "origin": (1, 2, 3)}
            source = image(tmp_path / str(round), **geometry)
        given = {} if kind == "path" else geometry
        size = marrow.dask.extract_to_file(source, 2, tmp_path / name, closed=True, space=space, blocks=blocks, **given)
        whole = marrow.extract(marrow.Volume(samples, **geometry), 2, closed=True)
        whole.write(tmp_path / ("whole-" + name), space=space)
        assert size == (len(whole.points), len(whole.triangles))
        assert (tmp_path / name).read_bytes() == (tmp_path / ("whole-" + name)).read_bytes()


def test_any_number_of_workers_gives_the_same_bytes(client, tmp_path):
    rng = np.random.default_rng(8)
    samples = alternating_noise(rng, (40, 30, 35), "u2")
    source = stored(tmp_path, samples, (8, 8, 8))
    with workers(1, tmp_path / "workers") as alone:
        for count, cluster in ((1, alone), (4, client)):
            cluster.wait_for_workers(count, timeout=60)
            assert len(cluster.scheduler_info()["workers"]) == count
            for topology in (False, True):
                whole = marrow.extract(samples, 2, topology=topology)
                whole.write(tmp_path / "whole.ply")
                settings = {"topology": topology, "client": cluster}
                marrow.dask.extract_to_file(source, 2, tmp_path / "surface.ply", blocks=(8, 16, 35), **settings)
                assert same_bytes(marrow.dask.extract(source, 2, blocks=(16, 8, 16), **settings), whole)
                assert (tmp_path / "surface.ply").read_bytes() == (tmp_path / "whole.ply").read_bytes()


@pytest.mark.parametrize("seed", [1, 3, 4])
def test_random_cuts_of_a_scan_give_the_same_bytes(client, tmp_path, seed):
    path = Path(os.environ.get("MARROW_TEST_DATA", ""), "tooth_sci/tooth_sci/tooth.nhdr")
    if not path.exists():
        pytest.skip("MARROW_TEST_DATA names no folder with tooth_sci")
    rng = np.random.default_rng(seed)
    volume = marrow.read(path)
    source = stored(tmp_path, volume.array, rng.integers(10, 40, 3).tolist())
    whole = marrow.extract(volume.array, 650, closed=True)
    whole.write(tmp_path / "whole.ply")
    for _ in range(2):
        settings = {"closed": True, "blocks": rng.integers(20, 160, 3)}
        marrow.dask.extract_to_file(source, 650, tmp_path / "surface.ply", **settings)
        assert (tmp_path / "surface.ply").read_bytes() == (tmp_path / "whole.ply").read_bytes()
        assert same_bytes(marrow.dask.extract(source, 650, **settings), whole)


def test_a_killed_worker_changes_nothing(client, tmp_path):
    """A worker is killed in the middle of counting, and another in the middle of writing."""
    k, j, i = np.mgrid[:120, :90, :100]
    samples = (100 + 60 * np.sin(k / 5) * np.cos(j / 7) * np.sin(i / 6)).astype(np.uint8)
    source = SlowArray(stored(tmp_path, samples, (8, 8, 100)), tmp_path / "reads")
    path = tmp_path / "surface.ply"
    killed = []
    client.wait_for_workers(4, timeout=60)  # those of the tests before may have ended, and start again
    # Asked beforehand: a call to all workers while one of them ends may wait for ever.
    first, second, *_ = client.run(os.getpid).values()

    def kill(after, process):
        while source.reads() < after:
            time.sleep(0.01)
        os.kill(process, signal.SIGKILL)
        killed.append(process)

    blocks = (16, 16, 100)
    kills = [threading.Thread(target=kill, args=of, daemon=True) for of in ((10, first), (60, second))]
    for thread in kills:
        thread.start()
    marrow.dask.extract_to_file(source, 100, path, blocks=blocks)
    for thread in kills:
        thread.join()
    assert len(killed) == 2
    marrow.extract(samples, 100).write(tmp_path / "whole.ply")
    assert path.read_bytes() == (tmp_path / "whole.ply").read_bytes()
    assert not [name for name in os.listdir(tmp_path) if name.startswith(".marrow")]


class SlowArray:
    """An array whose reads take a while and are counted, by the length of a file, and fail after the last."""

    def __init__(self, array, log, last=10**6):
        self.array, self.log, self.last = array, log, last
        self.shape, self.dtype, self.chunks = array.shape, array.dtype, array.chunks

    def __getitem__(self, slices):
        with open(self.log, "ab") as log:
            log.write(b".")
        time.sleep(0.02)
        if self.reads() > self.last:
            raise RuntimeError("the store is gone")
        return self.array[slices]

    def reads(self):
        return self.log.stat().st_size if self.log.exists() else 0


SlowArray.__module__ = "__main__"  # so that workers, which cannot import this file, get the class itself


def test_real_scans_have_the_bytes_of_the_whole(client, tmp_path):
    folder = os.environ.get("MARROW_TEST_DATA")
    scans = sorted(Path(folder).rglob("*.nii.gz"))[:1] if folder else []
    if not scans:
        pytest.skip("no real scan: MARROW_TEST_DATA is not set")
    volume = marrow.read(scans[0])
    source = stored(tmp_path, volume.array, (32, 32, 32))
    isovalue = marrow.otsu(volume)
    placed = marrow.Volume(volume.array, affine=volume.affine)
    for topology in (False, True):
        settings = {"closed": True, "topology": topology}
        whole = marrow.extract(volume, isovalue, **settings)
        mesh = marrow.dask.extract(source, isovalue, blocks=(50, 70, 90), affine=volume.affine, **settings)
        assert len(whole.triangles) == len(mesh.triangles) > 10000
        assert same_bytes(mesh, marrow.extract(placed, isovalue, **settings))


def label_map(rng, shape, dtype, values):
    """Boxes of labels, with noise where they meet."""
    centres = rng.uniform(0, 1, (3 * len(values), 3)) * shape
    positions = np.moveaxis(np.indices(shape), 0, -1) + rng.normal(0, 0.6, (*shape, 3))
    nearest = np.abs(positions[..., None, :] - centres).max(-1).argmin(-1)
    return np.array(values, dtype)[nearest % len(values)]


@pytest.mark.parametrize(
    "dtype, values, background",
    [
        ("u1", (0, 1, 2, 7), 0),
        ("i2", (-5, 0, 3), 3),
        ("f4", (0, 2, 9), 0),
        ("?", (0, 1), 0),
        ("u8", (7, 2**60, 2**60 + 1, 2**63 + 5), 8),  # beyond float64 and int64, and the background is nowhere
        (">i8", (0, 4, 2**40), 4),
    ],
)
def test_labels_have_the_bytes_of_the_whole(client, tmp_path, dtype, values, background):
    rng = np.random.default_rng(9)
    for relax, kind in ((1, "numpy"), (3, "zarr"), (40, "dask")):
        samples = label_map(rng, rng.integers(12, 34, 3), dtype, values)
        source = {
            "numpy": lambda: samples,
            "zarr": lambda: stored(tmp_path / str(relax), samples, tuple(rng.integers(3, 9, 3))),
            "dask": lambda: dask.array.from_array(samples, chunks=tuple(rng.integers(3, 9, 3))),
        }[kind]()
        settings = {"background": background, "relax": relax, "normals": relax != 1}
        surfaces = marrow.dask.labels(source, blocks=rng.integers(4, 16, 3), **settings, **OBLIQUE)
        whole = marrow.labels(marrow.Volume(samples, **OBLIQUE), **settings)
        assert list(surfaces) == list(whole) and len(whole) > 0
        for label, mesh in surfaces.items():
            assert same_bytes(mesh, whole[label])
            assert (mesh.name, mesh.colour) == (whole[label].name, whole[label].colour)


def test_labels_of_a_folder(client, tmp_path):
    samples = label_map(np.random.default_rng(10), (30, 20, 25), "u2", (0, 1, 5))
    stored(tmp_path, samples, (8, 8, 8))
    geometry = {"spacing": (0.7, 0.9, 1.3), "origin": (1, 2, 3)}
    table = {5: marrow.LabelEntry("liver", (1, 0, 0))}
    surfaces = marrow.dask.labels(image(tmp_path, **geometry), relax=2, table=table, blocks=(8, 8, 8))
    whole = marrow.labels(marrow.Volume(samples, **geometry), relax=2)
    assert surfaces.keys() == whole.keys() == {1, 5} and surfaces[5].name == "liver"
    assert all(same_bytes(mesh, whole[label]) for label, mesh in surfaces.items())


def test_labels_of_a_segmentation_have_the_names_of_its_segments(client):
    samples = label_map(np.random.default_rng(12), (20, 20, 20), "u1", (0, 1, 2, 3))
    segments = {1: marrow.LabelEntry("liver", (1, 0, 0)), 2: marrow.LabelEntry("spleen")}
    series = marrow.SeriesInfo("", "", "SEG", samples.shape, (1, 1, 1), 1, segments)
    volume = marrow.Volume(samples, info=marrow.ScanInfo("NRRD", series, (), None))
    table = {2: marrow.LabelEntry("", (0, 1, 0))}
    surfaces = marrow.dask.labels(volume, relax=2, table=table)
    assert {label: mesh.name for label, mesh in surfaces.items()} == {1: "liver", 2: "spleen", 3: "label-3"}
    whole = marrow.labels(volume, relax=2, table=table)
    assert all((mesh.name, mesh.colour) == (whole[n].name, whole[n].colour) for n, mesh in surfaces.items())


def test_atlases_have_the_bytes_of_the_whole(client):
    atlas = Path("/usr/share/mricron/templates/aal.nii.gz")
    if not atlas.exists():
        pytest.skip("no atlas: mricron-data is not installed")
    volume = marrow.read(atlas)
    whole = marrow.labels(marrow.Volume(volume.array, affine=volume.affine), relax=10)
    surfaces = marrow.dask.labels(volume.array, relax=10, blocks=(70, 90, 181), affine=volume.affine)
    assert list(surfaces) == list(whole) and len(whole) > 100
    assert all(same_bytes(mesh, whole[label]) for label, mesh in surfaces.items())


@pytest.mark.parametrize("topology", [False, True])
def test_fragments_of_neuroglancer(client, tmp_path, topology):
    rng = np.random.default_rng(5)
    samples = noise(rng, (20, 21, 22), "u1")
    folder = tmp_path / "mesh"
    settings = {"segment": 7, "blocks": (8, 9, 10), "topology": topology}
    size = marrow.dask.write_fragments(samples, 2, folder, **settings, **OBLIQUE)
    assert json.loads((folder / "info").read_text()) == {"@type": "neuroglancer_legacy_mesh"}
    names = json.loads((folder / "7:0").read_text())["fragments"]
    assert sorted(os.listdir(folder)) == sorted(["info", "7:0", *names]) and len(names) > 8
    corners, points = [], 0
    for name in names:
        content = (folder / name).read_bytes()
        (count,) = np.frombuffer(content, "<u4", 1)
        nanometres = np.frombuffer(content, "<f4", 3 * count, 4).reshape(-1, 3)
        triangles = np.frombuffer(content, "<u4", offset=4 + 12 * count).reshape(-1, 3)
        points += count
        corners += [nanometres[triangles]]
    corners = np.concatenate(corners)
    assert size == (points, len(corners))
    # The same triangles, in another order: neighbouring fragments have equal points.
    whole = marrow.extract(marrow.Volume(samples, **OBLIQUE), 2, topology=topology)
    expected = (whole.points[whole.triangles].astype(float) * 1e6).astype("<f4")
    assert {c.tobytes() for c in corners} == {c.tobytes() for c in expected}
    assert len(corners) == len(expected)


def test_fragments_go_beside_others_but_replace_no_other_info(client, tmp_path):
    samples = noise(np.random.default_rng(5), (20, 21, 22), "u1")
    meshes = b'{"@type": "neuroglancer_legacy_mesh", "mip": 2}'
    (tmp_path / "info").write_bytes(meshes)
    marrow.dask.write_fragments(samples, 2, tmp_path, segment=2**64 - 1)
    assert (tmp_path / "info").read_bytes() == meshes and (tmp_path / f"{2**64 - 1}:0").exists()
    marrow.dask.write_fragments(samples, 2, tmp_path, segment=True)
    assert (tmp_path / "1:0").exists()
    for number, other in enumerate((b'{"@type": "neuroglancer_multiscale_volume"}', b'{"scales": []}', b"[]", b"?")):
        folder = tmp_path / str(number)
        folder.mkdir()
        (folder / "info").write_bytes(other)
        with pytest.raises(marrow.InputError, match="info.* another folder"):
            marrow.dask.write_fragments(samples, 2, folder)
        assert os.listdir(folder) == ["info"] and (folder / "info").read_bytes() == other
    for segment in (-1, 2**64, 1.5, "../x"):
        with pytest.raises(marrow.InputError, match="segment"):
            marrow.dask.write_fragments(samples, 2, tmp_path / "mesh", segment=segment)
    assert not (tmp_path / "mesh").exists()


def test_errors(client, tmp_path):
    samples = np.zeros((20, 20, 20), np.uint8)
    path = tmp_path / "surface.ply"
    for call in (
        lambda: marrow.dask.extract(samples, 2),
        lambda: marrow.dask.extract_to_file(samples, 2, path),
        lambda: marrow.dask.write_fragments(samples, 2, tmp_path / "mesh"),
    ):
        with pytest.raises(marrow.EmptySurface, match="isovalue 2"):
            call()
    samples[5:9] = 5
    with pytest.raises(marrow.InputError, match="extension"):
        marrow.dask.extract_to_file(samples, 2, tmp_path / "surface.obj")
    with pytest.raises(marrow.InputError, match="not a finite number"):
        marrow.dask.extract(samples, float("nan"))
    with pytest.raises(marrow.InputError, match="three axes"):
        marrow.dask.extract(samples[0], 2)
    for blocks in (5, (4, 0, 4), (4, 4), (4, 2.5, 4), "444", [None] * 3):
        for call in (marrow.dask.labels, lambda array, blocks: marrow.dask.extract(array, 2, blocks=blocks)):
            with pytest.raises(marrow.InputError, match="^blocks are three sizes of at least one sample, not .*$"):
                call(samples, blocks=blocks)
    with pytest.raises(marrow.InputError, match="^client is a dask.distributed.Client, not 'tcp://host:8786'$"):
        marrow.dask.extract(samples, 2, client="tcp://host:8786")
    with pytest.raises(marrow.InputError, match="give a LabelEntry"):
        marrow.dask.labels(samples, table={5: "liver"})
    with pytest.raises(marrow.InputError, match="path or an array"):
        marrow.dask.extract(5, 2)
    with pytest.raises(OSError):
        marrow.dask.extract(tmp_path / "missing.zarr", 2)
    with pytest.raises(marrow.InputError, match="not integers"):
        marrow.dask.labels(samples + 0.5)
    with pytest.raises(marrow.InputError, match="relaxation"):
        marrow.dask.labels(samples, relax=-1)
    with pytest.raises(marrow.InputError, match="background"):
        marrow.dask.labels(samples.astype(np.uint64), background=-1)
    with pytest.raises(marrow.InputError, match="complex"):
        marrow.dask.extract(samples.astype(complex), 2)
    assert os.listdir(tmp_path) == ["mesh"]


def test_a_folder_that_states_no_spacing_is_given_one(client, tmp_path):
    samples = noise(np.random.default_rng(12), (20, 21, 22), "u1")
    stored(tmp_path, samples, (8, 8, 8))
    folder, path = tmp_path / "samples.zarr", tmp_path / "surface.ply"
    whole = marrow.extract(marrow.Volume(samples, spacing=2), 2)
    assert same_bytes(marrow.dask.extract(folder, 2, spacing=2), whole)
    assert marrow.dask.extract_to_file(folder, 2, path, spacing=2) == (len(whole.points), len(whole.triangles))
    with pytest.raises(marrow.GeometryError, match="spacing"):
        marrow.dask.extract(folder, 2)


def test_coordinates_of_xarray_place_the_surface(client, tmp_path):
    xarray = pytest.importorskip("xarray")
    samples = noise(np.random.default_rng(9), (20, 21, 22), "u1")
    array = dask.array.from_array(samples.transpose(2, 0, 1), chunks=(8, 8, 8))
    coords = dict(z=30 + 2.0 * np.arange(20), y=20 - 1.5 * np.arange(21), x=10 + 0.5 * np.arange(22))
    chunked = xarray.DataArray(array, coords, ("x", "z", "y"))
    whole = marrow.extract(chunked, 2)
    whole.write(tmp_path / "whole.ply")
    for source in (chunked, chunked.compute(), marrow.as_volume(chunked)):
        assert same_bytes(marrow.dask.extract(source, 2, blocks=(9, 9, 9)), whole)
        marrow.dask.extract_to_file(source, 2, tmp_path / "surface.ply", blocks=(9, 9, 22))
        assert (tmp_path / "surface.ply").read_bytes() == (tmp_path / "whole.ply").read_bytes()
        with pytest.raises(marrow.InputError, match="do not give others"):
            marrow.dask.extract(source, 2, spacing=2)


def test_blocks_of_another_type_than_that_of_the_array_are_refused(client, tmp_path):
    samples = noise(np.random.default_rng(10), (20, 20, 20), "f8")
    source = SlowArray(stored(tmp_path, samples, (8, 8, 8)), tmp_path / "reads")
    source.dtype = np.dtype("f4")
    with pytest.raises(marrow.InputError, match="float64, .* float32"):
        marrow.dask.extract(source, 2)


def test_blocks_of_dask_that_are_not_what_the_array_promises_are_refused(client, tmp_path):
    array = dask.array.from_array(noise(np.random.default_rng(10), (20, 20, 20), "u1"), chunks=8)
    for source, message in (
        (array.map_blocks(lambda block: block * 1.5, dtype="i2"), "float64, .* int16"),
        (array.map_blocks(lambda block: block[:-1], dtype="u1"), "has the shape"),
    ):
        for call in (
            lambda: marrow.dask.extract(source, 2, blocks=(8, 8, 8)),
            lambda: marrow.dask.extract_to_file(source, 2, tmp_path / "surface.ply"),
        ):
            with pytest.raises(marrow.InputError, match=message):
                call()


def test_chunks_may_be_empty_but_not_of_unknown_size(client, tmp_path):
    samples = noise(np.random.default_rng(13), (20, 20, 20), "u1")
    uneven = dask.array.from_array(samples, chunks=((0, 3, 0, 17), (20,), (1, 19)))
    assert same_bytes(marrow.dask.extract(uneven, 2), marrow.extract(samples, 2))
    assert _blocks._chunk(uneven, 0) == 17 and _blocks._chunk(uneven, 2) == 19
    unknown = uneven[uneven[:, 0, 0] < 100]
    for call in (
        lambda: marrow.dask.extract(unknown, 2),
        lambda: marrow.dask.labels(unknown),
        lambda: marrow.extract_to_file(unknown, 2, tmp_path / "surface.ply"),
    ):
        with pytest.raises(marrow.InputError, match="compute_chunk_sizes"):
            call()
    assert same_bytes(marrow.dask.extract(unknown.compute_chunk_sizes(), 2), marrow.extract(samples, 2))


def test_an_open_surface_of_a_single_slice_is_refused_with_the_reason(client, tmp_path):
    array = np.array([[[0, 9], [0, 9]]], np.uint8)
    for call in (
        lambda **closed: marrow.dask.extract(array, 0.5, **closed),
        lambda **closed: marrow.dask.extract_to_file(array, 0.5, tmp_path / "surface.ply", **closed),
        lambda **closed: marrow.dask.write_fragments(array, 0.5, tmp_path / "mesh", **closed),
    ):
        with pytest.raises(marrow.EmptySurface, match="at least 2 samples along each axis: give closed=True"):
            call()
        call(closed=True)


@pytest.mark.parametrize("shape", [(0, 4, 4), (4, 0, 4), (4, 4, 0)])
def test_arrays_without_samples_have_no_surface(client, tmp_path, shape):
    array = np.zeros(shape, np.uint8)
    for source in (array, dask.array.from_array(array), zarr.zeros(shape, dtype="u1")):
        for call in (
            lambda: marrow.dask.extract(source, 2),
            lambda: marrow.dask.extract_to_file(source, 2, tmp_path / "surface.ply"),
            lambda: marrow.dask.write_fragments(source, 2, tmp_path / "mesh"),
        ):
            with pytest.raises(marrow.EmptySurface, match="no sample"):
                call()
        assert marrow.dask.labels(source) == marrow.labels(array) == {}


def test_samples_that_are_not_the_values_are_refused(client, tmp_path):
    """The surface of the values, as float32, has other bytes than that of the samples."""
    samples = noise(np.random.default_rng(14), (20, 20, 20), "i2")
    volume = marrow.Volume(samples, spacing=2)._with_rescale((0.1, -3.4))
    for call in (
        lambda: marrow.dask.extract(volume, -3.2),
        lambda: marrow.dask.extract_to_file(volume, -3.2, tmp_path / "surface.ply"),
        lambda: marrow.dask.labels(volume),
    ):
        with pytest.raises(marrow.InputError, match=r"Volume\(volume.array"):
            call()
    values = marrow.Volume(volume.array, affine=volume.affine)
    assert same_bytes(marrow.dask.extract(values, -3.2), marrow.extract(values, -3.2))


def test_arguments_are_checked_before_the_array_is_read(client, tmp_path):
    samples = noise(np.random.default_rng(6), (40, 20, 20), "u1")
    source = SlowArray(stored(tmp_path, samples, (8, 8, 8)), tmp_path / "reads")
    path = tmp_path / "surface.ply"
    for error, call in (
        (marrow.InputError, lambda: marrow.dask.extract_to_file(source, 2, tmp_path / "surface.obj")),
        (marrow.InputError, lambda: marrow.dask.extract_to_file(source, 2, path, space="XYZ")),
        (marrow.IoError, lambda: marrow.dask.extract_to_file(source, 2, tmp_path / "missing" / "surface.ply")),
        (marrow.InputError, lambda: marrow.dask.extract_to_file(source, "bone", path)),
        (marrow.InputError, lambda: marrow.dask.extract(source, None)),
        (marrow.InputError, lambda: marrow.dask.write_fragments(source, "bone", tmp_path / "mesh")),
        (marrow.IoError, lambda: marrow.dask.labels(source, table=tmp_path / "missing.txt")),
    ):
        with pytest.raises(error) as raised:
            call()
        assert "\n" not in str(raised.value)
    assert source.reads() == 0 and os.listdir(tmp_path) == ["samples.zarr"]


def test_masked_samples_are_refused(client, tmp_path):
    masked = np.ma.masked_equal(noise(np.random.default_rng(8), (20, 20, 20), "u1"), 3)
    for source in (masked, dask.array.from_array(masked, chunks=(8, 8, 8), asarray=False)):
        for call in (
            lambda: marrow.dask.extract(source, 2),
            lambda: marrow.dask.extract_to_file(source, 2, tmp_path / "surface.ply"),
            lambda: marrow.dask.labels(source),
        ):
            with pytest.raises(marrow.InputError, match="filled"):
                call()


def test_an_error_in_the_middle_of_writing_leaves_the_old_file(client, tmp_path):
    samples = noise(np.random.default_rng(6), (40, 20, 20), "u1")
    source = SlowArray(stored(tmp_path, samples, (8, 8, 8)), tmp_path / "reads", last=12)
    path = tmp_path / "surface.ply"
    path.write_text("old")
    with pytest.raises(RuntimeError, match="the store is gone") as error:
        marrow.dask.extract_to_file(source, 2, path, blocks=(8, 20, 20))
    assert error.traceback and path.read_text() == "old"
    assert sorted(os.listdir(tmp_path)) == ["reads", "samples.zarr", "surface.ply"]


@pytest.mark.parametrize("dtype, topology", [("u1", False), (">u2", False), ("f4", False), ("f4", True)])
def test_chunks_without_surface_are_read_once(tmp_path, dtype, topology):
    """They are damaged after the samples were counted."""
    z, y, x = np.ogrid[:40, :36, :50]
    samples = (250 - 5 * np.sqrt((z - 18) ** 2 + (y - 16) ** 2 + (x - 30.0) ** 2)).clip(0).astype(dtype)
    isovalue, options = 180, (False, topology)
    stored(tmp_path, samples, (6, 5, 7))
    source = _blocks.Source(image(tmp_path, (1, 1, 1), (0, 0, 0)))
    layers = list(source.layers((18, 15, 50), whole_rows=True, threads=2))
    counted = [
        [marrow.dask._count(source.array, block, source.geometry, isovalue, *options) for block in layer]
        for layer in layers
    ]
    chunks = {True: set(), False: set()}
    for known in (block.chunks for layer in counted for block in layer):
        for index, is_known in np.ndenumerate(known.are_known):
            chunks[bool(is_known)].add(tuple(int(first + i) for first, i in zip(known.first, index)))
    damaged = chunks[True] - chunks[False]
    assert len(damaged) > len(chunks[False])
    for index in damaged:
        (tmp_path / "samples.zarr" / ".".join(map(str, index))).write_bytes(b"damaged")

    size = marrow.dask._total(marrow.dask._size(block) for layer in counted for block in layer)
    file = _marrow.FileOfParts(tmp_path / "surface.ply", size.points, size.triangles, normals=True, space="LPS")
    before = marrow.SurfaceSize(0, 0)
    for layer, blocks, following in zip(layers, counted, [*counted[1:], []]):
        numbered = marrow.dask._number(blocks, [marrow.dask._first_slice(block) for block in following], before)
        for block, numbers in zip(layer, numbered):
            marrow.dask._write(source.array, block, source.geometry, isovalue, *options, numbers, file.description)
        before = marrow.dask._total([before, *map(marrow.dask._size, blocks)])
    file.commit()
    native = samples.astype(samples.dtype.newbyteorder("="))
    marrow.extract(native, isovalue, topology=topology).write(tmp_path / "whole.ply")
    assert (tmp_path / "surface.ply").read_bytes() == (tmp_path / "whole.ply").read_bytes()

    with pytest.raises(marrow.InputError, match="damaged"):
        marrow.dask._count(source.array, layers[0][0], source.geometry, isovalue, *options)
    out = np.empty((6, 5, 7), source.array.dtype)
    with pytest.raises(marrow.InputError, match="an element for each chunk"):
        source.array.open().read((0, 0, 0), out, (np.ones((1, 1, 2), "u1"), np.ones((1, 1, 1), out.dtype)))


def test_cuts_let_chunks_be_read_once():
    """Of the chunks of a block, only the last along each axis are those of the next block too."""
    for samples, block, chunk in ((2048, 512, 64), (100, 30, 7), (65, 64, 64), (9, 3, 1), (1, 5, 5), (2, 9, 4)):
        ranges = _blocks._ranges(samples, block, chunk)
        assert ranges[0][0] == 0 and ranges[-1][1] == samples
        for (begin, end), (following, _) in zip(ranges, ranges[1:]):
            assert end == following + 1 and end - begin > 1
            if chunk > 1:
                assert (following - 1) % chunk == 0  # gradients begin with a chunk


def test_blocks_of_a_store_fit_in_memory_and_occupy_all_workers():
    assert _blocks._streamed_blocks((2048, 2048, 2048), (64, 64, 64), 1, 64, 2) == [1024, 512, 2048]
    for shape in ((5000, 3000, 2000), (300, 300, 300), (46000, 46000, 46000), (7, 20000, 30000)):
        for threads in (1, 8, 1000):
            slices, rows, row = _blocks._streamed_blocks(shape, (32, 32, 32), 2, 32, threads)
            assert row == shape[2] and slices <= shape[0] and rows <= shape[1]
            assert rows == 32 or 32 * rows * row * 2 <= _blocks.STEP_BYTES
            share = 2 * np.prod(shape, dtype=np.int64) // (_blocks.BLOCKS_PER_THREAD * threads)
            size = slices * rows * row * 2
            assert size <= min(max(share, _blocks.LEAST_STREAMED_BYTES), _blocks.MOST_STREAMED_BYTES)


def test_steps_read_each_slice_once():
    """A step reads whole chunks, beside those that the step before has read."""
    for whole, first, dims, at_once in ((64, 0, 64, 16), (64, 17, 30, 16), (65, 1, 64, 16), (40, 33, 7, 16), (9, 0, 1, 4)):
        block = _blocks.Block((5, 5, whole), (0, 0, first), (5, 5, dims), np.dtype("u1"), at_once)
        steps = block.steps()
        assert steps[0].first[2] == first and steps[-1].first[2] + steps[-1].dims[2] == first + dims
        ends = [step.with_halo()[1][0].stop for step in steps]
        assert ends == sorted(set(ends))
        assert all(end % at_once == 0 for end in ends[:-1])
        for step, following in zip(steps, steps[1:]):
            assert step.first[2] + step.dims[2] == following.first[2] + 1
            assert step.dims[2] > 1
