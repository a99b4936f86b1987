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


@pytest.mark.parametrize("value", ["5", None, [1, 2], 10**400, object])
def test_isovalues_are_numbers(ball, tmp_path, value):
    for call in (
        lambda: marrow.extract_to_file(ball, value, tmp_path / "surface.ply"),
        lambda: marrow.IsosurfaceExtractor(ball).extract(value),
    ):
        with pytest.raises(marrow.InputError, match="^the isovalue is a number, not .*$"):
            call()


@pytest.mark.parametrize("values", [3.0, None, ["low"], [[1.0], [2.0]], [[1.0], [2.0, 3.0]]])
def test_a_sweep_has_a_sequence_of_isovalues(ball, values):
    with pytest.raises(marrow.InputError, match="^isovalues are a sequence of numbers.*$"):
        marrow.sweep(ball, values)


@pytest.mark.parametrize("dtype", ["u1", "i4", "u4", "i8", "u8"])
def test_the_background_is_an_integer(ball, dtype):
    for background in (1.7, "0", None):
        with pytest.raises(marrow.InputError, match="^the background label is an integer, not .*$"):
            marrow.labels((ball > 300).astype(dtype), background=background)


def test_a_table_of_labels_is_read_before_the_work(ball, tmp_path):
    fractions = []
    with pytest.raises(marrow.IoError):
        marrow.labels((ball > 300).astype("u1"), table=tmp_path / "missing.txt", progress=fractions.append)
    assert fractions == []


@pytest.mark.parametrize("dtype", ["u4", "i8"])
def test_labels_of_every_type_are_those_of_int32(ball, dtype):
    labels = (ball > 300).astype("i4") + (ball > 600)
    for order in "CF":
        ours = marrow.labels(numpy.asarray(labels, dtype, order))
        for label, mesh in marrow.labels(numpy.asarray(labels, order=order)).items():
            assert numpy.array_equal(ours[label].points, mesh.points)
            assert numpy.array_equal(ours[label].triangles, mesh.triangles)
