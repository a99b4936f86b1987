import os
import pathlib

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


@pytest.mark.parametrize("value", ["5", b"5", None, [1, 2], 10**400, object, numpy.complex64(5 + 1j)])
def test_isovalues_are_numbers(ball, tmp_path, value):
    for call in (
        lambda: marrow.extract_to_file(ball, value, tmp_path / "surface.ply"),
        lambda: marrow.IsosurfaceExtractor(ball).extract(value),
        lambda: marrow.extract(ball, value),
        lambda: marrow.find_thin_walls(ball, value, marrow.extract(ball, 300.5)),
    ):
        with pytest.raises(marrow.InputError, match="^the isovalue is a number, .*not .*$"):
            call()


@pytest.mark.parametrize(
    "values", [3.0, None, ["low"], ["1", "2"], [0, 2j], [0, 10**400], [[1.0], [2.0]], [[1.0], [2.0, 3.0]]]
)
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


def one_line_of(call):
    with pytest.raises(marrow.InputError) as raised:
        call()
    assert "\n" not in str(raised.value) and "object at 0x" not in str(raised.value)
    return str(raised.value)


def test_what_is_no_mesh_no_sweep_and_no_label_entry_is_named(ball, tmp_path):
    mesh = marrow.extract(ball, 300.5)
    walls = marrow.find_thin_walls(ball, 300.5, mesh)
    for call in (
        lambda: mesh.distance(3),
        lambda: marrow.write_meshes([mesh, 3], tmp_path / "meshes.obj"),
        lambda: marrow.find_thin_walls(ball, 300.5, 3),
        lambda: walls.near(3),
    ):
        assert one_line_of(call) == "int is not Mesh: marrow.extract makes one, read_mesh reads one"
    assert "marrow.sweep" in one_line_of(lambda: marrow.find_plateaus(3, ball))
    assert "info" in one_line_of(lambda: marrow.Volume(ball, info="a head"))
    map = (ball > 300).astype("u1")
    assert "'x' for label 1: give a LabelEntry" in one_line_of(lambda: marrow.labels(map, table={1: "x"}))


@pytest.mark.parametrize("path", ["x.nrrd", pathlib.Path("x.nrrd")])
def test_a_path_is_no_volume(path):
    for call in (lambda: marrow.Volume(path), lambda: marrow.marching_cubes(path)):
        assert one_line_of(call) == "'x.nrrd' is a path and not a volume: read it with marrow.read"


def test_a_vector_has_three_numbers(ball, tmp_path):
    dates = numpy.array(["2026-11-29"] * 3, "M8[D]")
    too_few_or_many = ((1, 2), (1, 2, 3, 4))
    no_numbers = ((1, "a", 3), (1, 10**400, 3), [[1], [2, 3]], "abc", ("1", "2", "3"), (1, 2j, 3), dates)
    for values in too_few_or_many + no_numbers:
        for name, call in (
            ("lower", lambda: marrow.crop(ball, values, (5, 5, 5))),
            ("upper", lambda: marrow.crop(ball, (1, 1, 1), values)),
            ("spacing", lambda: marrow.read(tmp_path, spacing=values)),
            ("spacing", lambda: marrow.inspect(tmp_path, spacing=values)),
            ("spacing", lambda: marrow.Volume(ball, spacing=values)),
        ):
            assert one_line_of(call).startswith(f"{name} is not 3 numbers: ")
    assert one_line_of(lambda: marrow.crop(ball, 1, (5, 5, 5))) == "lower is not 3 numbers: 1"
    assert one_line_of(lambda: marrow.Volume(ball, spacing=10**400)).startswith("spacing is not 3 numbers: ")
    assert one_line_of(lambda: marrow.marching_cubes(ball, spacing=2)) == "spacing is not 3 numbers: 2"


def test_a_number_is_not_several(ball):
    for name, call in (
        ("sigma", lambda: marrow.gaussian_filter(ball, (1, 1, 1))),
        ("spacing", lambda: marrow.resample_isotropic(ball, (1, 1, 1))),
        ("level", lambda: marrow.marching_cubes(ball, (1, 1, 1))),
    ):
        assert one_line_of(call) == f"{name} is a number, not (1, 1, 1)"
    for bound in ("x", [[1], [2, 3]], [[10**400] * 3] * 3, object):
        assert "bound" in one_line_of(lambda: marrow.extract(ball, 300.5).smooth(bound=bound))


def test_a_series_is_text_or_a_number(tmp_path):
    for series in (1.5, [1], numpy.zeros(2)):
        assert one_line_of(lambda: marrow.read(tmp_path, series=series)).startswith("series is an id or a number, not ")


@pytest.mark.parametrize("dtype", ["u4", "i8"])
def test_labels_of_every_type_are_those_of_int32(ball, dtype):
    labels = (ball > 300).astype("i4") + (ball > 600)
    for order in "CF":
        ours = marrow.labels(numpy.asarray(labels, dtype, order))
        for label, mesh in marrow.labels(numpy.asarray(labels, order=order)).items():
            assert numpy.array_equal(ours[label].points, mesh.points)
            assert numpy.array_equal(ours[label].triangles, mesh.triangles)
