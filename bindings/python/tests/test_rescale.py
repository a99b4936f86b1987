"""Scans whose values have a fraction: the samples stay as stored, and every function takes and gives values."""

import struct

import marrow
import numpy as np
import pytest
from test_memory import peak_growth

SLOPE, INTERCEPT = 0.25, -1011.375


def write_nifti(path, array, slope, intercept):
    header = bytearray(352)
    struct.pack_into("<i", header, 0, 348)
    struct.pack_into("<8h", header, 40, 3, *reversed(array.shape), 1, 1, 1, 1)
    struct.pack_into("<2h", header, 70, {"int16": 4, "uint8": 2}[array.dtype.name], 8 * array.itemsize)
    struct.pack_into("<4f", header, 76, 1, 0.5, 1, 2)
    struct.pack_into("<3f", header, 108, 352, slope, intercept)
    header[123] = 2
    header[344:348] = b"n+1\0"
    path.write_bytes(bytes(header) + array.tobytes())


@pytest.fixture
def stored(ball):
    noise = np.random.default_rng(1).normal(0, 8, ball.shape)
    return (4 * ball + noise + 10).round().astype(np.int16)


@pytest.fixture
def scan_file(stored, tmp_path):
    path = tmp_path / "ball.nii"
    write_nifti(path, stored, SLOPE, INTERCEPT)
    return path


@pytest.fixture
def scan(scan_file):
    return marrow.read(scan_file)


@pytest.fixture
def plain(scan):
    return marrow.Volume(scan.array, affine=scan.affine)


def same(mesh, other):
    return np.array_equal(mesh.points, other.points) and np.array_equal(mesh.triangles, other.triangles)


def test_the_array_has_values(scan, stored):
    assert scan.rescale == (SLOPE, INTERCEPT)
    assert "int16 * 0.25 - 1011.375" in repr(scan)
    assert scan.samples.dtype == np.int16 and np.array_equal(scan.samples, stored)
    assert scan.dtype == scan.array.dtype == np.float32
    assert np.array_equal(scan.array, (SLOPE * stored.astype(float) + INTERCEPT).astype(np.float32))
    assert "int16" in repr(scan) and "int16" in scan._repr_html_()
    with pytest.raises(ValueError, match="read-only"):
        scan.array[0, 0, 0] = 1  # it would not change the scan
    part = scan[3:9, ::-1, 2:]
    assert part.rescale == scan.rescale and np.array_equal(part.array, scan.array[3:9, ::-1, 2:])
    other = marrow.Volume(stored)
    assert other.rescale == (1, 0) and other.array is other.samples is stored


def test_whole_numbers_stay_as_they_were(stored, tmp_path):
    write_nifti(tmp_path / "whole.nii", stored, 2, -1024)
    whole = marrow.read(tmp_path / "whole.nii")
    assert whole.rescale == (1, 0) and whole.dtype == np.float32 and whole.samples is whole.array


def test_surfaces_are_those_of_the_values(scan, plain):
    isovalue = -1011.3
    mesh, expected = (marrow.extract(v, isovalue, closed=True, trust=True) for v in (scan, plain))
    assert np.array_equal(mesh.triangles, expected.triangles)
    assert np.abs(mesh.points - expected.points).max() < 1e-3
    assert np.abs(mesh.normals - expected.normals).max() < 1e-3
    assert mesh.trust.noise.sigma == pytest.approx(expected.trust.noise.sigma, rel=1e-3)
    assert np.allclose(mesh.trust.shift, expected.trust.shift, atol=1e-3)
    stored_isovalue = (isovalue - INTERCEPT) / SLOPE
    assert same(mesh, marrow.extract(marrow.Volume(scan.samples, affine=scan.affine), stored_isovalue, closed=True))
    assert same(mesh, marrow.IsosurfaceExtractor(scan, closed=True).extract(isovalue))
    with pytest.raises(marrow.EmptySurface, match="samples range from -7381.6"):
        marrow.extract(scan, 90000)


def test_numbers_are_those_of_the_values(scan, plain):
    ours, values = marrow.histogram(scan, 50), marrow.histogram(plain, 50)
    assert np.allclose(ours.edges, values.edges, atol=1e-3)
    assert np.abs(ours.counts - values.counts).sum() < ours.counts.sum() / 100
    assert marrow.otsu(scan) == pytest.approx(marrow.otsu(plain), abs=1e-3)
    isovalues = [-1100.0, -1011.3, -900.0]
    swept, expected = marrow.sweep(scan, isovalues), marrow.sweep(plain, isovalues)
    assert np.array_equal(swept.isovalue, isovalues)
    assert np.array_equal(swept.triangles, expected.triangles)
    assert np.allclose(swept.volume, expected.volume, rtol=1e-4)


def test_filters_keep_the_rescale_or_give_values(scan, plain):
    median = marrow.median_filter(scan, 1)
    assert median.rescale == scan.rescale
    assert np.array_equal(median.array, marrow.median_filter(plain, 1).array)
    blurred = marrow.gaussian_filter(scan, 0.8)
    assert blurred.rescale == (1, 0)
    assert np.array_equal(blurred.array, marrow.gaussian_filter(plain, 0.8).array)


def test_files_have_the_bytes_of_a_surface_in_memory(scan, scan_file, tmp_path):
    whole, streamed, sliced = (tmp_path / f"{name}.ply" for name in ("whole", "streamed", "sliced"))
    marrow.extract(scan, -1011.3).write(whole)
    marrow.extract_to_file(scan_file, -1011.3, streamed, max_memory="500M")
    marrow.extract_to_file(scan, -1011.3, sliced, max_memory="500M")
    assert whole.read_bytes() == streamed.read_bytes() == sliced.read_bytes()


def test_labels_are_values(scan):
    with pytest.raises(marrow.InputError, match="not integers"):
        marrow.labels(scan)


def test_reading_takes_half_of_the_memory(tmp_path):
    path = tmp_path / "large.nii"
    array = np.zeros((256, 256, 256), np.int16)
    array[64:192, 64:192, 64:192] = 1000
    for slope in (1.0, 0.5):  # warms up, too
        write_nifti(path, array, slope, -1024)
        scan, growth = peak_growth(lambda: marrow.read(path, threads=1))
    assert scan.rescale == (0.5, -1024)
    assert growth < 1.25 * array.nbytes
    mesh, growth = peak_growth(lambda: marrow.extract(scan, -800.25, threads=1))
    assert growth < mesh.points.nbytes + mesh.normals.nbytes + mesh.triangles.nbytes + array.nbytes / 4
