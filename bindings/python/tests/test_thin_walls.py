"""Walls too thin for the scan, on a frame with a plate that blur takes out of the surface."""

import numpy as np
import pytest

import marrow

OPENING = 15  # mm


@pytest.fixture(scope="module")
def scan():
    k, j, i = np.abs(np.indices((20, 32, 32)) - np.array([9, 15, 15]).reshape(3, 1, 1, 1))
    inner = (j <= OPENING // 2) & (i <= OPENING // 2)
    bone = (k <= 4) & (j <= 11) & (i <= 11) & ~inner
    plate = (k == 0) & inner
    return marrow.gaussian_filter(np.where(bone, 1500.0, np.where(plate, 1000.0, -1000.0)).astype(np.int16), 0.75)


@pytest.fixture(scope="module")
def frame(scan):
    return marrow.extract(scan, "bone", closed=True)


@pytest.fixture(scope="module")
def walls(scan, frame):
    return marrow.find_thin_walls(scan, "bone", frame, noise=5)


def handles(mesh):
    measures = mesh.measure()
    return measures.components - measures.euler_characteristic // 2


def test_they_are_found_where_they_vanished(walls):
    assert len(walls) == 1
    # The frame outshines the samples beside it.
    assert walls.area == walls.areas.sum() == pytest.approx((OPENING - 2) ** 2)
    np.testing.assert_allclose(walls.positions, [[15, 15, 9]], atol=1.5)


def test_restoring_closes_the_opening(walls, frame):
    assert handles(frame) == 1
    restored = marrow.extract(walls.restore(), "bone", closed=True)
    assert handles(restored) == 0
    assert restored.check().is_sound


def test_points_near_them_are_on_the_rim_of_the_opening(walls, frame):
    rim = frame.points[walls.near(frame)]
    assert len(rim) > 0
    assert np.abs(rim[:, 2] - 9).max() < 3
    assert np.abs(rim[:, :2] - 15).max() < OPENING / 2 + 3
    assert len(rim) < len(frame.points) / 2


def test_they_are_the_same_in_any_order_of_the_axes(scan, frame, walls):
    array = np.asfortranarray(scan.array)  # the slowest axis is the fastest in memory
    found = marrow.find_thin_walls(array, 225.5, frame, noise=5)
    assert found.area == pytest.approx(walls.area)
    np.testing.assert_allclose(found.positions, walls.positions)
    np.testing.assert_array_equal(found.restore().array, walls.restore().array)
    assert np.array_equal(found.restore().affine, walls.restore().affine)
    # The order of the axes decides how polygons are cut into triangles.
    volumes = [marrow.extract(w.restore(), 225.5, closed=True).measure().volume for w in (found, walls)]
    assert volumes[0] == pytest.approx(volumes[1], rel=1e-4)


def test_a_tissue_needs_ct(frame):
    with pytest.raises(marrow.InputError, match="Hounsfield"):
        marrow.find_thin_walls(np.zeros((4, 4, 4)), "bone", frame)
    with pytest.raises(marrow.InputError, match="finite"):
        marrow.find_thin_walls(np.zeros((4, 4, 4)), np.nan, frame)
