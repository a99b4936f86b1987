"""What extract_to_file says of arguments without a surface, and of limits."""

import numpy as np
import pytest

import marrow

FLAT = np.array([[[0, 9], [0, 9]]], np.uint8)


def test_an_open_surface_of_a_single_slice_is_refused_with_the_reason(tmp_path):
    for array in (FLAT, FLAT.transpose(1, 0, 2), FLAT.transpose(1, 2, 0)):
        for call in (
            lambda **closed: marrow.extract(array, 0.5, **closed),
            lambda **closed: marrow.extract_to_file(array, 0.5, tmp_path / "a.ply", **closed),
        ):
            with pytest.raises(marrow.EmptySurface, match="at least 2 samples along each axis: give closed=True"):
                call()
            call(closed=True)


def test_a_volume_without_finite_samples_has_no_surface(tmp_path):
    array = np.full((3, 4, 5), np.nan, np.float32)
    for closed in (False, True):
        with pytest.raises(marrow.EmptySurface, match="no finite sample"):
            marrow.extract_to_file(array, 0.5, tmp_path / "a.ply", closed=closed)
    array[1] = 7
    with pytest.raises(marrow.EmptySurface, match="no surface at isovalue 8: all finite samples are on one side"):
        marrow.extract_to_file(array, 8, tmp_path / "a.ply")
    assert not list(tmp_path.iterdir())
    for array in (np.full((1, 3, 3), np.nan), np.zeros((0, 4, 4))):  # which closed=True does not change
        with pytest.raises(marrow.EmptySurface, match="no finite sample"):
            marrow.extract(array, 0.5)


@pytest.mark.parametrize("size", ["99999999T", 2**70, 10**19, "9" * 400, 0, "0.5"])
def test_max_memory_is_a_size_that_there_can_be(tmp_path, size):
    with pytest.raises(marrow.InputError, match="max_memory"):
        marrow.extract_to_file(FLAT, 0.5, tmp_path / "a.ply", closed=True, max_memory=size)


def test_the_largest_limit_is_taken(tmp_path):
    assert marrow.extract_to_file(FLAT, 0.5, tmp_path / "a.ply", closed=True, max_memory=10**18).points > 0
