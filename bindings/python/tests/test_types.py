"""The types of the package, for editors and mypy."""

import os
import subprocess
import sys
from pathlib import Path

import marrow
import pytest

pytest.importorskip("mypy")
ROOT = Path(__file__).parents[3]


def mypy(module, *arguments, cache):
    environment = {**os.environ, "MYPYPATH": str(Path(marrow.__file__).parents[1]), "MYPY_CACHE_DIR": str(cache)}
    command = [sys.executable, "-m", module, *map(str, arguments)]
    result = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True)
    assert result.returncode == 0, result.stdout + result.stderr


def test_the_package_and_the_examples_have_consistent_types(tmp_path):
    package = Path(marrow.__file__).parent
    mypy("mypy", "--config-file", "pyproject.toml", package, *ROOT.glob("examples/python/*.py"), cache=tmp_path)


def test_the_stub_of_the_native_module_names_what_it_holds(tmp_path):
    metaclasses = tmp_path / "allowed"  # of pybind11, which stubs do not state
    metaclasses.write_text("marrow._marrow.(Array(Extractor|Mesh|Part|Volume)|BoxReader|FileOfParts|FoundWalls)\n")
    options = ["--allowlist", metaclasses, "--mypy-config-file", "pyproject.toml"]
    mypy("mypy.stubtest", *options, "marrow._marrow", cache=tmp_path)
