"""Scans, filters, histograms, sweeps, labels, and surfaces that are written slice by slice."""

import os
import pathlib
import typing

import marrow
import numpy as np
import pytest
from marrow import _marrow


def write_nrrd(path, array, spacing=(1, 1, 1), origin=(0, 0, 0)):
    nz, ny, nx = array.shape
    kind = {"int16": "short", "uint8": "uchar", "float32": "float"}[array.dtype.name]
    directions = " ".join("(" + ",".join(str(s if a == b else 0) for b in range(3)) + ")" for a, s in enumerate(spacing))
    header = (
        f"NRRD0004\ntype: {kind}\ndimension: 3\nsizes: {nx} {ny} {nz}\nspace: left-posterior-superior\n"
        f"space directions: {directions}\nspace origin: ({','.join(map(str, origin))})\n"
        "encoding: raw\nendian: little\n\n"
    )
    path.write_bytes(header.encode() + np.ascontiguousarray(array).tobytes())


@pytest.fixture
def scan_file(ball, tmp_path):
    path = tmp_path / "ball.nrrd"
    write_nrrd(path, ball, (0.5, 1, 2), (1, 2, 3))
    return path


def test_a_scan_is_a_volume(ball, scan_file):
    scan = marrow.read(scan_file)
    assert np.array_equal(scan.array, ball)
    assert scan.dtype == np.int16 and scan.shape == ball.shape
    assert np.array_equal(scan.affine, [[0.5, 0, 0, 1], [0, 1, 0, 2], [0, 0, 2, 3], [0, 0, 0, 1]])
    assert scan.info.format == "NRRD" and scan.info.series.shape == ball.shape
    assert scan.warnings == ()
    text = scan._repr_html_()
    assert "32 x 31 x 30" in text and "data:image/png" in text


def test_a_scan_whose_name_is_not_utf_8_can_be_read(ball, tmp_path):
    path = os.fsdecode(os.fsencode(tmp_path) + b"/\xe4.nrrd")
    write_nrrd(pathlib.Path(path), ball)
    assert np.array_equal(marrow.read(path).array, ball)
    assert "\ufffd" in marrow.inspect(path).series[0].series.description


def test_the_samples_of_a_scan_outlive_it(ball, scan_file):
    part = marrow.read(scan_file).array[3:5, 2:]
    marrow.read(scan_file)  # would use freed memory
    assert np.array_equal(part, ball[3:5, 2:])


def test_inspection_reads_no_samples(ball, scan_file):
    report = marrow.inspect(scan_file)
    assert (report.format, report.files, report.chosen) == ("NRRD", 1, 0)
    assert report.series[0].series.shape == ball.shape
    assert report.series[0].memory == ball.nbytes
    assert "patient" not in repr(report)


def test_errors_of_readers(scan_file, tmp_path):
    with pytest.raises(OSError):
        marrow.read(tmp_path / "missing.nrrd")
    with pytest.raises(marrow.InputError, match="spacing"):
        marrow.read(scan_file, spacing=(1, 1, 1))
    scan_file.write_bytes(scan_file.read_bytes()[:-100])
    with pytest.raises(marrow.InputError, match="truncated"):
        marrow.read(scan_file)


def test_filters_keep_the_place_in_space(ball, scan_file):
    scan = marrow.read(scan_file)
    noisy = ball.copy()
    noisy[13, 14, 15] = -3000
    volume = marrow.Volume(noisy, affine=scan.affine)
    median = marrow.median_filter(volume, 1)
    assert median.dtype == np.int16 and median.array[13, 14, 15] > 900
    assert np.array_equal(median.affine, scan.affine)
    blurred = marrow.gaussian_filter(scan, 0.8)
    assert blurred.dtype == np.float32 and blurred.array.max() < 1000
    even = marrow.resample_isotropic(scan, 0.5)
    assert np.allclose(even.spacing, 0.5) and even.array[0, 0, 0] == ball[0, 0, 0]
    part = marrow.crop(scan, (4, 10, 20), (9, 20, 30))
    assert np.array_equal(part.array, ball[9:14, 8:19, 6:17])
    assert np.allclose(part.origin, (4, 10, 21))
    assert part.info is scan.info
    for bad in (lambda: marrow.median_filter(scan, 0), lambda: marrow.crop(scan, (99, 99, 99), (100, 100, 100))):
        with pytest.raises(marrow.InputError):
            bad()


@pytest.mark.parametrize("dtype", ["?", "i1", "u4", "i8", "u8", "f2", "f8", ">i2", ">u8"])
def test_crop_and_median_keep_the_type(ball, dtype):
    samples = (ball.clip(0, 1000) // 8).astype(dtype)
    part = marrow.crop(samples, (3, 4, 5), (20, 22, 24)).array
    assert part.dtype == samples.dtype and np.array_equal(part, samples[5:25, 4:23, 3:21])
    median = marrow.median_filter(samples, 1).array
    expected = marrow.median_filter(samples.astype(np.float64), 1).array
    assert median.dtype == samples.dtype and np.array_equal(median, expected)


def test_crop_copies_labels_beyond_2_53(label_map):
    labels = label_map + np.uint64(2**63)
    part = marrow.crop(labels, (1, 1, 1), (5, 6, 7)).array
    assert part.dtype == np.uint64 and np.array_equal(part, labels[1:8, 1:7, 1:6])


@pytest.mark.parametrize("transpose", [(0, 1, 2), (2, 0, 1)])
def test_filters_of_any_memory_order_agree(ball, transpose):
    view = np.transpose(ball, transpose)[::-1]
    volume = marrow.Volume(view, spacing=(1.1, 2.3, 3.7), origin=(0.1, 5, 6))
    same = marrow.Volume(view.copy(), spacing=(1.1, 2.3, 3.7), origin=(0.1, 5, 6))
    medians = [marrow.median_filter(v, 1) for v in (volume, same)]
    crops = [marrow.crop(v, (10, 20, 30), (25, 60, 90)) for v in (volume, same)]
    for results in medians, crops:
        assert np.array_equal(results[0].array, results[1].array)
        assert np.allclose(results[0].affine, results[1].affine)
    assert np.array_equal(medians[0].affine, volume.affine)
    blurred = [marrow.gaussian_filter(v, 2).array for v in (volume, same)]
    assert np.allclose(blurred[0], blurred[1], atol=0.01)
    results = [marrow.resample_isotropic(median, 0.9) for median in medians]
    assert results[0].array.shape == results[1].array.shape
    surfaces = [marrow.extract(result, 300.5).measure() for result in results]
    # Where the axes run backward, the new samples begin at the other end.
    assert surfaces[0].volume == pytest.approx(surfaces[1].volume, rel=0.01)
    assert np.allclose(surfaces[0].lower, surfaces[1].lower, atol=0.2)


def test_the_histogram_is_numpys(ball):
    result = marrow.histogram(ball, 50)
    counts, edges = np.histogram(ball, 50)
    assert np.array_equal(result.counts, counts)
    assert np.allclose(result.edges, edges)
    with_nan = ball.astype(float)
    with_nan[0, 0, :2] = np.nan, np.inf
    assert marrow.histogram(with_nan).non_finite_samples == 2


def test_otsu_separates_two_classes():
    steps = np.zeros((10, 10, 10), np.uint8)
    steps[3:7, 3:7, 3:7] = 200
    assert 50 < marrow.otsu(steps) < 150
    assert marrow.extract(steps, "otsu").measure().components == 1
    with pytest.raises(marrow.InputError):
        marrow.otsu(np.zeros((3, 3, 3)))


def test_tissues_are_for_ct(ball):
    ct = (ball.clip(-1000, 1000)).astype(np.int16)
    bone = marrow.extract(ct, "bone")
    assert bone.name == "bone" and bone.colour == marrow.TISSUE_PRESETS["bone"].colour
    assert np.array_equal(bone.points, marrow.extract(ct, 225.5).points)
    with pytest.raises(marrow.InputError, match="not air"):
        marrow.extract(ball.clip(0), "bone")
    with pytest.raises(marrow.InputError, match="one of bone"):
        marrow.extract(ct, "brain")


@pytest.mark.parametrize("isovalue", [None, [1, 2], "1e5x", np.nan, np.inf])
def test_bad_isovalues_are_refused(ball, isovalue):
    with pytest.raises(marrow.InputError):
        marrow.extract(ball, isovalue)


def test_a_sweep_measures_the_closed_surfaces(ball):
    isovalues = [-400.5, 0.5, 300.5]
    result = marrow.sweep(marrow.Volume(ball, spacing=0.5), isovalues)
    for k, isovalue in enumerate(isovalues):
        measures = marrow.extract(marrow.Volume(ball, spacing=0.5), isovalue, closed=True).measure()
        assert result.volume[k] == pytest.approx(measures.volume, rel=1e-4)
        assert result.components[k] == measures.components
        assert result.triangles[k] == measures.triangles


def test_a_sharp_edge_has_a_plateau():
    z, y, x = np.mgrid[:40, :40, :40]
    distance = np.sqrt((x - 20) ** 2 + (y - 20) ** 2 + (z - 20) ** 2)
    sharp = (1000 / (1 + np.exp(4 * (distance - 12)))).astype(np.float32)
    found = marrow.find_plateaus(marrow.sweep(sharp, np.linspace(5, 995, 100)), sharp)
    assert any(lower < 500 < upper for lower, upper in found)


def test_the_arrays_of_a_sweep_have_one_length(ball):
    none = np.zeros(0)
    broken = marrow.Sweep(np.linspace(0, 1, 5), none, none, none.astype(int), none.astype(int))
    with pytest.raises(marrow.InputError, match="same length"):
        marrow.find_plateaus(broken, ball)


@pytest.fixture
def label_map():
    labels = np.zeros((12, 13, 14), np.uint8)
    labels[2:6, 2:10, 2:10] = 3
    labels[6:10, 2:10, 2:10] = 7
    return labels


def test_labels_have_closed_surfaces_with_names_and_colours(label_map, tmp_path):
    table = tmp_path / "labels.txt"
    table.write_text("3 liver 255 0 0 255\n")
    meshes = marrow.labels(marrow.Volume(label_map, spacing=2), table=table)
    assert list(meshes) == [3, 7]
    assert (meshes[3].name, meshes[7].name) == ("liver", "label-7")
    assert meshes[3].colour == (1, 0, 0) and len(meshes[7].colour) == 3
    assert all(mesh.check().is_sound for mesh in meshes.values())
    assert marrow.count_labels(label_map) == {0: label_map.size - 512, 3: 256, 7: 256}
    marrow.write_meshes(list(meshes.values()), tmp_path / "labels.glb", verify=True)
    by_hand = marrow.labels(label_map, table={7: marrow.LabelEntry("spleen")})
    assert by_hand[7].name == "spleen"
    coloured = marrow.labels(label_map, table={7: marrow.LabelEntry("spleen", np.zeros(3))})[7]
    assert tuple(coloured.colour) == (0, 0, 0)
    coloured.write(tmp_path / "spleen.glb")
    assert "colour" in typing.get_type_hints(marrow.LabelEntry)


def test_names_of_labels_that_are_not_utf_8_can_be_read(tmp_path):
    table = tmp_path / "labels.txt"
    table.write_bytes(b'3 "n\xe9vrome"\n')
    assert marrow.read_label_table(table)[3].name == "n\ufffdvrome"


@pytest.mark.parametrize("dtype", ["uint32", "int64", "uint64", ">u8"])
def test_labels_beyond_32_bits_give_the_same_surfaces(label_map, dtype):
    large = {"uint32": 2**31, "int64": 2**62, "uint64": 2**63, ">u8": 2**63}[dtype]
    names = np.zeros(8, dtype)
    names[3], names[7] = large + 1, large + 2
    big = names[label_map]
    meshes, expected = marrow.labels(big), marrow.labels(label_map)
    assert list(meshes) == [large + 1, large + 2]
    for mesh, other in zip(meshes.values(), expected.values()):
        assert np.array_equal(mesh.points, other.points)
        assert np.array_equal(mesh.triangles, other.triangles)
    assert marrow.count_labels(big) == {0: label_map.size - 512, large + 1: 256, large + 2: 256}
    assert list(marrow.labels(big, background=large + 1)) == [0, large + 2]


@pytest.mark.parametrize("dtype", ["int32", "uint32", "int64", "uint64"])
def test_any_number_of_labels_is_counted_but_not_extracted(dtype):
    labels = np.arange(66000).astype(dtype).reshape(30, 40, 55)
    labels[0, 0, :3] = 7
    counts = marrow.count_labels(labels)
    assert list(counts) == list(range(3, 66000)) and counts.pop(7) == 4 and set(counts.values()) == {1}
    with pytest.raises(marrow.InputError, match="65535"):
        marrow.labels(labels)


@pytest.mark.parametrize("dtype", ["int32", "int64", "uint64"])
def test_65535_labels_besides_the_background_are_extracted(dtype):
    labels = np.arange(65536).astype(dtype).reshape(1, 256, 256)
    assert list(marrow.labels(labels, relax=0, normals=False)) == list(range(1, 65536))


def test_colours_of_negative_and_large_labels_are_those_of_the_library():
    labels = np.array([-3, -1, 5], np.int64).reshape(1, 1, 3)
    for small, large in zip(marrow.labels(labels.astype(np.int8)).values(), marrow.labels(labels).values()):
        assert small.colour == large.colour
    assert marrow.labels(labels)[-3].colour == pytest.approx(_marrow.default_label_colour(-3))
    ids = np.array([2**63 + 1, 2**63 + 2, 2**64 - 3], np.uint64).reshape(1, 1, 3)
    assert len({mesh.colour for mesh in marrow.labels(ids).values()}) == 3


def test_fractions_are_no_labels():
    with pytest.raises(marrow.InputError):
        marrow.labels(np.full((3, 3, 3), 0.5))


class Sliceable:
    """A volume on disk, such as Zarr's: only slices along the first axis can be had, on the calling thread."""

    def __init__(self, array):
        self.array, self.shape, self.dtype = array, array.shape, array.dtype
        self.largest = 0

    def __getitem__(self, key):
        assert isinstance(key, slice)
        self.largest = max(self.largest, key.stop - key.start)
        return self.array[key]


@pytest.mark.parametrize("dtype", ["int16", ">i2", "float16", "bool", "int64"])
@pytest.mark.parametrize("extension", ["stl", "ply"])
def test_slices_give_the_bytes_of_the_whole(ball, tmp_path, dtype, extension):
    balls = np.concatenate([ball] * 6).clip(-2000)
    source = Sliceable((balls >= 301 if dtype == "bool" else balls).astype(dtype))
    isovalue = 0.5 if dtype == "bool" else 300.5
    geometry = dict(spacing=(0.5, 1, 2), origin=(1, 2, 3))
    size = marrow.extract_to_file(source, isovalue, tmp_path / f"a.{extension}", max_memory="300K", **geometry)
    mesh = marrow.extract(marrow.Volume(source.array, **geometry), isovalue)
    mesh.write(tmp_path / f"b.{extension}")
    assert (tmp_path / f"a.{extension}").read_bytes() == (tmp_path / f"b.{extension}").read_bytes()
    assert size == (len(mesh.points), len(mesh.triangles))
    assert source.largest < len(balls)


def test_a_file_and_a_volume_are_sources_too(ball, scan_file, tmp_path):
    scan = marrow.read(scan_file)
    marrow.extract(scan, 300.5, closed=True).write(tmp_path / "whole.ply")
    for source in (scan, scan_file, str(scan_file)):
        marrow.extract_to_file(source, 300.5, tmp_path / "parts.ply", closed=True)
        assert (tmp_path / "parts.ply").read_bytes() == (tmp_path / "whole.ply").read_bytes()
    with pytest.raises(marrow.InputError, match="spacing"):
        marrow.extract_to_file(scan_file, 300.5, tmp_path / "parts.ply", spacing=2)


class Failing(Sliceable):
    def __getitem__(self, key):
        raise KeyError("chunk 7")


class Short(Sliceable):
    def __getitem__(self, key):
        return self.array[key][:, :-1]


@pytest.mark.parametrize(
    ("source", "options", "error"),
    [
        (Failing, {}, KeyError),
        (Short, {}, marrow.InputError),
        (Sliceable, dict(max_memory="1K"), marrow.LimitError),
        (Sliceable, dict(max_memory="much"), marrow.InputError),
        (Sliceable, dict(max_memory=-1), marrow.InputError),
        (Sliceable, dict(space="MNI"), marrow.InputError),
        (Sliceable, dict(progress=lambda fraction: False), marrow.Cancelled),
        (lambda array: Sliceable(array[0]), {}, marrow.InputError),
        (lambda array: Sliceable(array.astype(complex)), {}, marrow.InputError),
        (lambda array: Sliceable(array.clip(0, 100)), {}, marrow.EmptySurface),
        (lambda array: array.tolist(), {}, marrow.InputError),
    ],
)
def test_no_file_remains_after_an_error(ball, tmp_path, source, options, error):
    with pytest.raises(error):
        marrow.extract_to_file(source(ball), 300.5, tmp_path / "out.ply", **options)
    assert not list(tmp_path.iterdir())
