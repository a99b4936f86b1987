"""The Python in docs/python.md and README.md runs as it stands, one block after the other. `help` is the reference."""

import dataclasses
import re
from pathlib import Path

import marrow
import numpy as np
import pytest

ROOT = Path(__file__).parents[3]
# A block that needs one of these, where it is not installed, does not run.
OPTIONAL = {"SimpleITK", "nibabel", "pyvista", "vtkmodules"}


def write_nifti(path, samples):
    """A NIfTI-1 file of int16 samples [k, j, i], 1 mm apart."""
    header = np.zeros(1, np.dtype({
        "names": ["size", "dim", "type", "bits", "pixdim", "offset", "slope", "units", "sform", "rows", "magic"],
        "formats": ["<i4", "<8i2", "<i2", "<i2", "<8f4", "<f4", "<f4", "u1", "<i2", "<12f4", "S4"],
        "offsets": [0, 40, 70, 72, 76, 108, 112, 123, 254, 280, 344],
        "itemsize": 352,
    }))
    header["size"], header["type"], header["bits"], header["offset"], header["magic"] = 348, 4, 16, 352, b"n+1"
    header["dim"], header["pixdim"] = [3, *samples.shape[::-1], 1, 1, 1, 1], 1
    header["slope"], header["units"], header["sform"] = 1, 2, 1
    header["rows"] = np.eye(4)[:3].ravel()
    import gzip

    path.write_bytes(gzip.compress(header.tobytes() + samples.astype("<i2").tobytes()))


@pytest.mark.parametrize("page", ["docs/python.md", "README.md"])
def test_the_python_of_the_documentation_runs(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    k, j, i = np.ogrid[:40, :40, :40]
    head = 1500 - 120 * np.sqrt((k - 19.5) ** 2 + (j - 19.5) ** 2 + (i - 19.5) ** 2)
    write_nifti(tmp_path / "head.nii.gz", np.maximum(head, -1000))
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / page).read_text(), re.DOTALL)
    assert blocks
    names = {}
    for block in blocks:
        try:
            exec(compile(block, page, "exec"), names)
        except ModuleNotFoundError as error:
            if error.name.partition(".")[0] not in OPTIONAL:
                raise


def fields_of(kind):
    if dataclasses.is_dataclass(kind):
        return [field.name for field in dataclasses.fields(kind) if not field.name.startswith("_")]
    return list(getattr(kind, "_fields", []))


@pytest.mark.parametrize("name", [name for name in marrow.__all__ if fields_of(getattr(marrow, name))])
def test_the_help_of_a_class_describes_its_fields(name):
    kind = getattr(marrow, name)
    attributes = kind.__doc__.partition("    Attributes\n    ----------\n")[2]
    described = re.findall(r"^    (\w[\w, ]*) : \S.*\n        \S", attributes, re.MULTILINE)
    assert ", ".join(described).split(", ") == fields_of(kind)
