"""No copy of a volume is made where none is promised, as seen by the memory that a call takes."""

from pathlib import Path

import marrow
import numpy as np
import pytest


def peak_growth(function):
    """Return the result of a function, and the bytes of memory that it takes at most beyond those before.

    The system may map other pages of the process meanwhile. So the function is called three times, and the least is
    returned.
    """

    def status(key):
        lines = Path("/proc/self/status").read_text().splitlines()
        return 1024 * next(int(line.split()[1]) for line in lines if line.startswith(key))

    growths = []
    for _ in range(3):
        try:
            Path("/proc/self/clear_refs").write_text("5")  # the peak begins anew
        except OSError:
            pytest.skip("this system does not let a process reset its peak of memory")
        before = status("VmRSS")
        result = function()
        growths.append(status("VmHWM") - before)
    return result, min(growths)


@pytest.fixture(scope="module")
def large():
    axis = np.arange(256, dtype=np.float32) - 127.3
    square = axis**2
    return 100 - np.sqrt(square[:, None, None] + square[:, None] + square)


@pytest.mark.parametrize(
    "view",
    [
        lambda array: array,
        lambda array: array.T,
        lambda array: array[::-1, :, ::-1],
        lambda array: array[3:-3, 2:-2, 1:-1],
        lambda array: array.transpose(1, 2, 0)[:, 5:, ::-1],
        lambda array: marrow.Volume(array, spacing=(1, 2, 3))[4:, ::-1, 9:],
        lambda array: memoryview(array),
    ],
)
def test_an_extraction_does_not_copy_the_volume(large, view):
    def extract():
        return marrow.extract(view(large), 0.5, threads=1)

    extract()  # loads code and starts threads
    mesh, growth = peak_growth(extract)
    result = mesh.points.nbytes + mesh.triangles.nbytes + mesh.normals.nbytes
    assert growth < result + large.nbytes / 4


def test_an_extraction_to_a_file_stays_within_its_limit(large, tmp_path):
    def extract():
        return marrow.extract_to_file(large, 0.5, tmp_path / "ball.ply", max_memory="12M", threads=1)

    extract()
    _, growth = peak_growth(extract)
    assert growth < 24 * 2**20  # a slab of the array is not copied twice


def test_files_and_measures_do_not_copy_the_mesh(large, tmp_path):
    mesh = marrow.extract(large, 0.5)
    for use in (mesh.measure, lambda: mesh.write(tmp_path / "ball.ply")):
        use()
    _, growth = peak_growth(lambda: mesh.write(tmp_path / "ball.ply"))
    assert growth < mesh.points.nbytes
