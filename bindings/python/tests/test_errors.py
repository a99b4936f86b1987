import os

import marrow
import pytest


@pytest.mark.parametrize(
    ("error", "builtin"),
    [
        (marrow.InputError, ValueError),
        (marrow.GeometryError, ValueError),
        (marrow.IoError, OSError),
        (marrow.LimitError, MemoryError),
    ],
)
def test_handlers_of_the_builtin_exception_catch_it(error, builtin):
    assert issubclass(error, builtin)
    assert issubclass(error, marrow.Error)


def test_names_of_files_may_be_any_bytes(tmp_path):
    file = tmp_path / os.fsdecode(b"sch\xe4del.nii")
    file.write_bytes(b"no scan")
    with pytest.raises(marrow.InputError, match=r"sch\\xe4del.nii.*not a NIfTI file"):
        marrow.read(file)
