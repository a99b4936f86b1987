"""The types of the package, for editors and mypy."""

import json
import os
import subprocess
import sys
from pathlib import Path

import marrow
import pytest

pytest.importorskip("mypy")
ROOT = Path(__file__).parents[3]

# Runs mypy, and then stubtest on what mypy has read: both take most of their time to read NumPy's types.
SCRIPT = """
import contextlib, io, json, sys
from mypy import build, main, stubtest

allowed, *files = sys.argv[1:]
sources, options = main.process_options(["--config-file", "pyproject.toml", "--cache-dir", "/dev/null", *files])
result = build.build(sources, options)
errors, result.errors = result.errors, []
stubtest.mypy.build.build = lambda sources, options: result
sys.argv = ["stubtest", "--allowlist", allowed, "--mypy-config-file", "pyproject.toml", "marrow._marrow"]
with contextlib.redirect_stdout(io.StringIO()) as output:
    code = stubtest.main()
print(json.dumps({"errors": errors, "code": code, "output": output.getvalue()}))
"""


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    package = Path(marrow.__file__).parent
    metaclasses = tmp_path_factory.mktemp("types") / "allowed"  # of pybind11, which stubs do not state
    metaclasses.write_text("marrow._marrow.(Array(Extractor|Mesh|Part|Volume)|BoxReader|FileOfParts|FoundWalls)\n")
    command = [sys.executable, "-c", SCRIPT, metaclasses, package, *ROOT.glob("examples/python/*.py")]
    environment = {**os.environ, "MYPYPATH": str(package.parent)}
    result = subprocess.run(list(map(str, command)), cwd=ROOT, env=environment, capture_output=True, text=True)
    assert result.returncode == 0, result.stdout + result.stderr
    return json.loads(result.stdout)


def test_the_package_and_the_examples_have_consistent_types(found):
    assert not found["errors"], "\n".join(found["errors"])


def test_the_stub_of_the_native_module_names_what_it_holds(found):
    assert found["code"] == 0, found["output"]
