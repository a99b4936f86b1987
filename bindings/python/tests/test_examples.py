"""The programs in examples/python/, on a ball with a radius of 20 mm: 33.5 mL."""

import os
import re
import subprocess
import sys
from pathlib import Path

import marrow
import numpy as np
import pytest

EXAMPLES = Path(__file__).parents[3] / "examples/python"


@pytest.fixture
def ball(tmp_path):
    k, j, i = np.ogrid[:48, :48, :48]
    samples = (1000 - 50 * np.sqrt((k - 23.5) ** 2 + (j - 23.5) ** 2 + (i - 23.5) ** 2)).astype("<i2")
    header = "NRRD0004\ntype: int16\ndimension: 3\nsizes: 48 48 48\nspace: left-posterior-superior\n"
    header += "space directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\nendian: little\nencoding: raw\n\n"
    (tmp_path / "ball.nrrd").write_bytes(header.encode() + samples.tobytes())
    np.save(tmp_path / "ball.npy", samples)
    return tmp_path


def run(name, *arguments, cwd):
    command = [sys.executable, EXAMPLES / name, *arguments]
    result = subprocess.run(command, cwd=cwd, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    return result.stdout


def test_extract(ball):
    assert re.fullmatch(r"\d+ triangles enclose 33\.[45] mL\n", run("extract.py", "ball.nrrd", "-0.5", "a.stl", cwd=ball))
    assert marrow.read_mesh(ball / "a.stl").measure().boundary_edges == 0


def test_drop_in(ball):
    area, exact = re.search(r"area (\d+) of (\d+)", run("drop_in.py", cwd=ball)).groups()
    assert float(area) == pytest.approx(float(exact), rel=2e-3)


def test_print_ready(ball):
    output = run("print_ready.py", "ball.nrrd", "-0.5", "b.stl", cwd=ball)
    before, after, distance = re.match(r"(\d+) triangles became (\d+), at most ([\d.]+) mm away", output).groups()
    assert int(after) < int(before) / 2 and float(distance) <= 0.1
    assert output.endswith("closed: True, manifold: True\n")


def test_larger_than_memory(ball):
    size = re.match(r"wrote (\d+) points and (\d+) triangles", run("larger_than_memory.py", "ball.npy", "-0.5", "c.ply", cwd=ball))
    mesh = marrow.read_mesh(ball / "c.ply")
    assert (len(mesh.points), len(mesh.triangles)) == tuple(map(int, size.groups()))
    assert mesh.measure().volume == pytest.approx(33500 / 4, rel=0.01)


def test_atlas(ball):
    pytest.importorskip("vtkmodules")
    atlas = Path("/usr/share/mricron/templates/aal.nii.gz")
    if not atlas.exists() or not os.environ.get("DISPLAY"):
        pytest.skip("needs Debian's package mricron-data and a display")
    assert run("atlas.py", atlas, "atlas.png", cwd=ball).startswith("drew 116 labels")
    assert (ball / "atlas.png").stat().st_size > 30000
