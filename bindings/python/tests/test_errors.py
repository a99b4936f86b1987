import os

import marrow
import numpy
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


def test_messages_name_the_options_of_python(tmp_path):
    nibabel = pytest.importorskip("nibabel")
    file = tmp_path / "options.volume.nii"
    nibabel.save(nibabel.Nifti1Image(numpy.zeros((3, 3, 3, 2), numpy.int16), numpy.eye(4)), file)
    with pytest.raises(marrow.InputError) as raised:
        marrow.read(file)
    message = str(raised.value)
    assert message.startswith(f"'{file}'")
    assert message.endswith("choose one from 0 to 1 with volume")
    with pytest.raises(marrow.LimitError, match="^max_memory must"):
        marrow.extract_to_file(numpy.zeros((9, 9, 9)), 0, tmp_path / "a.ply", max_memory=1000)
