"""The wheel, the source archive, and a build without Python."""

import importlib.util
import os
import subprocess
import sys
import sysconfig
import tarfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
BUILD = os.environ.get("MARROW_BUILD")
pytestmark = pytest.mark.skipif(not BUILD, reason="MARROW_BUILD names no build folder")

# What a user of the package would run; prints the files of Marrow that the process has loaded.
SCRIPT = """
import marrow, numpy
ball = 5 - numpy.sqrt(sum((numpy.indices((16, 16, 16)) - 7.5) ** 2))
assert len(marrow.marching_cubes(ball, 0).verts) == len(marrow.extract(ball, 0).points)
maps = open("/proc/self/maps").read().split()
print(marrow.__version__)
print(*sorted({path for path in maps if "marrow" in path.rsplit("/")[-1]}), sep="\\n")
"""


def run(*command, cwd=None):
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    result = subprocess.run(
        [str(argument) for argument in command], cwd=cwd, env=environment, text=True, capture_output=True
    )
    assert result.returncode == 0, result.stdout + result.stderr
    return result.stdout


def version():
    specification = importlib.util.spec_from_file_location(
        "marrow_build", ROOT / "bindings/python/build_backend/marrow_build.py"
    )
    backend = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(backend)
    return backend.VERSION


@pytest.fixture
def virtual_environment(tmp_path):
    run(sys.executable, "-m", "venv", "--system-site-packages", "--without-pip", tmp_path / "venv")
    return tmp_path / "venv"


def check_installed(environment, folder):
    """The package works from any folder, with no library from outside the environment."""
    output = run(environment / "bin/python", "-c", SCRIPT, cwd=folder).splitlines()
    assert output[0] == version()
    assert len(output) == 5  # the native module and three shared libraries
    assert all(path.startswith(str(environment)) for path in output[1:])
    expected = f"marrow {version()}\n"
    assert run(environment / "bin/python", "-m", "marrow", "--version", cwd=folder) == expected
    assert run(environment / "bin/marrow", "--version", cwd=folder) == expected
    description = run(environment / "bin/python", "-m", "pip", "show", "marrow", cwd=folder).splitlines()
    assert {f"Version: {version()}", "License: Apache-2.0", "Requires: numpy"} <= set(description)


def test_a_wheel_is_built_without_network_and_runs_from_any_folder(tmp_path, virtual_environment):
    run(sys.executable, "-m", "pip", "wheel", ROOT, "--no-index", "--no-build-isolation", "--no-deps",
        "--config-settings", f"build-dir={BUILD}", "--wheel-dir", tmp_path)
    (wheel,) = tmp_path.glob("*.whl")
    python = "cp{}{}".format(*sys.version_info)
    platform = sysconfig.get_platform().replace("-", "_")
    assert wheel.name == f"marrow-{version()}-{python}-{python}-{platform}.whl"
    run(virtual_environment / "bin/python", "-m", "pip", "install", "--no-index", "--no-deps", wheel)
    check_installed(virtual_environment, tmp_path)


def test_pip_installs_a_checkout(tmp_path, virtual_environment):
    run(virtual_environment / "bin/python", "-m", "pip", "install", "--no-index", ROOT,
        "--config-settings", f"build-dir={BUILD}")
    check_installed(virtual_environment, tmp_path)


def test_the_same_sources_give_the_same_wheel(tmp_path):
    for folder in ["first", "second"]:
        run(sys.executable, "-m", "pip", "wheel", ROOT, "--no-index", "--no-build-isolation", "--no-deps",
            "--config-settings", f"build-dir={BUILD}", "--wheel-dir", tmp_path / folder)
    first, second = tmp_path.glob("*/*.whl")
    assert first.read_bytes() == second.read_bytes()


def test_an_unknown_setting_is_an_error(tmp_path):
    result = subprocess.run(
        [sys.executable, "-m", "pip", "wheel", ROOT, "--no-index", "--no-build-isolation", "--no-deps",
         "--config-settings", "programs=off", "--wheel-dir", tmp_path], text=True, capture_output=True)
    assert result.returncode != 0
    assert "the settings are program=on or program=off, gpu=on or gpu=off, and build-dir=FOLDER" in result.stdout + result.stderr


def test_the_source_archive_holds_what_a_build_needs(tmp_path):
    code = f"import marrow_build; print(marrow_build.build_sdist({str(tmp_path)!r}))"
    name = run(sys.executable, "-c", code, cwd=ROOT / "bindings/python/build_backend").strip()
    assert name == f"marrow-{version()}.tar.gz"
    with tarfile.open(tmp_path / name) as archive:
        archive.extractall(tmp_path)
    source = tmp_path / f"marrow-{version()}"
    metadata = (source / "PKG-INFO").read_text().splitlines()
    assert {f"Version: {version()}", "Requires-Dist: numpy>=1.23,<2"} <= set(metadata)
    run("cmake", "-S", source, "-B", tmp_path / "build", "-G", "Ninja", "-Wno-dev",
        "-D", "MARROW_PYTHON=ON", "-D", f"Python_EXECUTABLE={sys.executable}")


def test_the_library_builds_where_python_cannot_be_had(tmp_path):
    run("cmake", "-S", ROOT, "-B", tmp_path, "-G", "Ninja", "-Wno-dev",
        "-D", "CMAKE_DISABLE_FIND_PACKAGE_Python=ON", "-D", "CMAKE_DISABLE_FIND_PACKAGE_pybind11=ON")
    assert "marrow_python" not in run("ninja", "-C", tmp_path, "-t", "targets", "all")
