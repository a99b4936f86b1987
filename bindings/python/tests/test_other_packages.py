"""Images of other packages arrive at their place in space, and meshes go to other packages."""

import ctypes
import gc
import sys
import types
import weakref

import marrow
import numpy as np
import pytest

DIRECTION = np.array([[0, 0.6, 0.8], [1, 0, 0], [0, 0.8, -0.6]])


def address(volume):
    return volume._native().address


@pytest.fixture
def vtk_image(ball):
    pytest.importorskip("vtkmodules")
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonDataModel import vtkImageData

    image = vtkImageData()
    nz, ny, nx = ball.shape
    image.SetExtent(5, 4 + nx, -7, ny - 8, 11, 10 + nz)
    image.SetSpacing(0.5, 1, 2)
    image.SetOrigin(10, 20, 30)
    image.SetDirectionMatrix(*DIRECTION.ravel())
    image.GetPointData().SetScalars(numpy_to_vtk(ball.ravel()))
    return image


def test_a_sample_of_vtk_lies_where_vtk_says(ball, vtk_image):
    volume = marrow.as_volume(vtk_image)
    assert address(volume) == ball.ctypes.data
    for k, j, i in ((0, 0, 0), (3, 4, 5), (29, 30, 31)):
        point = vtk_image.GetPoint((k * ball.shape[1] + j) * ball.shape[2] + i)
        assert np.allclose(volume.affine @ [i, j, k, 1], [*point, 1])
        assert volume.array[k, j, i] == ball[k, j, i]


def test_surfaces_of_vtk_and_marrow_coincide(vtk_image):
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkFiltersCore import vtkFlyingEdges3D

    theirs = vtkFlyingEdges3D()
    theirs.SetInputData(vtk_image)
    theirs.SetValue(0, 300.5)
    theirs.Update()
    points = vtk_to_numpy(theirs.GetOutput().GetPoints().GetData())
    mesh = marrow.extract(vtk_image, 300.5)
    assert len(points) == len(mesh.points)
    nearest = [np.linalg.norm(mesh.points - point, axis=1).min() for point in points[::50]]
    assert max(nearest) < 1e-3


def test_vtk_without_samples_at_points_is_refused(vtk_image):
    from vtkmodules.util.numpy_support import numpy_to_vtk

    vtk_image.GetPointData().SetScalars(numpy_to_vtk(np.zeros((vtk_image.GetNumberOfPoints(), 3))))
    with pytest.raises(marrow.InputError, match="3 components"):
        marrow.as_volume(vtk_image)
    vtk_image.GetPointData().Initialize()
    with pytest.raises(marrow.InputError, match="scalars"):
        marrow.as_volume(vtk_image)


def test_scalars_of_vtk_that_do_not_fit_the_image_are_refused(vtk_image):
    vtk_image.SetDimensions(3, 4, 5)
    with pytest.raises(marrow.InputError, match="3 x 4 x 5"):
        marrow.as_volume(vtk_image)


def test_a_negative_spacing_of_vtk_mirrors_the_image(ball, vtk_image):
    vtk_image.SetSpacing(0.5, -1, 2)
    test_a_sample_of_vtk_lies_where_vtk_says(ball, vtk_image)
    assert marrow.as_volume(vtk_image).spacing.tolist() == [0.5, 1, 2]


def test_chars_of_vtk_are_integers_and_bits_are_refused(vtk_image):
    from vtkmodules.vtkCommonCore import vtkBitArray, vtkCharArray

    number = vtk_image.GetNumberOfPoints()
    chars, bits = vtkCharArray(), vtkBitArray()
    for array in (chars, bits):
        array.SetNumberOfValues(number)
        array.Fill(0)
    chars.SetComponent(7, 0, -5)
    vtk_image.GetPointData().SetScalars(chars)
    volume = marrow.as_volume(vtk_image)
    assert volume.array.flat[7] == chars.GetComponent(7, 0) and np.count_nonzero(volume.array) == 1
    vtk_image.GetPointData().SetScalars(bits)
    with pytest.raises(marrow.InputError, match="one bit"):
        marrow.as_volume(vtk_image)


def test_vtk_shares_the_arrays_of_a_mesh(ball):
    pytest.importorskip("vtkmodules")
    from vtkmodules.util.numpy_support import vtk_to_numpy

    mesh = marrow.extract(ball, 300.5)
    surface = mesh.to_vtk()
    points = vtk_to_numpy(surface.GetPoints().GetData())
    assert np.shares_memory(points, mesh.points)
    assert np.shares_memory(vtk_to_numpy(surface.GetPointData().GetNormals()), mesh.normals)
    assert np.shares_memory(vtk_to_numpy(surface.GetPolys().GetConnectivityArray()), mesh.triangles)
    assert surface.GetNumberOfCells() == len(mesh.triangles)
    expected = mesh.points[mesh.triangles[17]].copy()
    del mesh, points
    cell = surface.GetCell(17).GetPoints()
    assert np.array_equal([cell.GetPoint(corner) for corner in range(3)], expected)


@pytest.mark.parametrize("dtype", [np.int32, np.uint32])
def test_surfaces_of_vtk_outlive_the_arrays_of_a_mesh(dtype):
    """Each array has memory of its own, which is overwritten when it is freed."""
    pytest.importorskip("vtkmodules")
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkCommonTransforms import vtkTransform
    from vtkmodules.vtkFiltersGeneral import vtkTransformPolyDataFilter

    points = np.arange(30000).reshape(-1, 3)
    triangles = points % len(points)

    def array(values, dtype):
        memory = ctypes.create_string_buffer(values.size * 4)
        result = np.frombuffer(memory, dtype).reshape(values.shape)
        result[:] = values
        weakref.finalize(memory, ctypes.memset, ctypes.addressof(memory), 0x55, len(memory))
        return result

    def surface():
        mesh = marrow.Mesh(array(points, np.float32), array(triangles, np.int32))
        mesh.triangles = mesh.triangles if dtype == np.int32 else mesh.triangles.astype(dtype)
        return mesh.to_vtk()

    def moved():
        change = vtkTransformPolyDataFilter()
        change.SetTransform(vtkTransform())
        change.SetInputData(surface())
        change.Update()
        return change.GetOutput()

    for made in (surface(), moved()):
        gc.collect()
        others = [np.full(points.size, 7, np.int64) for _ in range(10)]
        assert np.array_equal(vtk_to_numpy(made.GetPolys().GetConnectivityArray()), triangles.ravel())
        assert np.array_equal(vtk_to_numpy(made.GetPoints().GetData()), points)
        del others


@pytest.mark.parametrize("scaled", [False, True])
def test_a_voxel_of_nibabel_lies_where_nibabel_says(ball, tmp_path, scaled):
    nibabel = pytest.importorskip("nibabel")
    affine = np.eye(4)
    affine[:3, :3] = DIRECTION * [0.5, 1, 2]
    affine[:3, 3] = 10, 20, 30
    image = nibabel.Nifti1Image(np.asfortranarray(ball.T), affine)
    if scaled:
        image.header.set_slope_inter(0.5, 3)
    nibabel.save(image, tmp_path / "ball.nii")
    image = nibabel.load(tmp_path / "ball.nii")
    volume = marrow.as_volume(image)
    assert not volume._native().is_copy  # in nibabel's memory order
    assert np.shares_memory(volume.array, np.asanyarray(image.dataobj)) or scaled or isinstance(
        volume.array.base, np.memmap
    )
    for index in ((0, 0, 0), (3, 4, 5), (31, 30, 29)):
        right, anterior, superior, _ = image.affine @ [*index, 1]
        assert np.allclose(volume.affine @ [*index, 1], [-right, -anterior, superior, 1])
        assert volume.array[index[::-1]] == image.dataobj[index]
    # The file that Marrow reads itself is the same volume.
    own = marrow.read(tmp_path / "ball.nii")
    assert np.allclose(own.affine, volume.affine, atol=1e-5)
    assert np.allclose(own.array, volume.array)


@pytest.mark.parametrize("unit", ["unknown", "mm", "meter", "micron"])
def test_units_of_nibabel_become_millimetres(ball, tmp_path, unit):
    nibabel = pytest.importorskip("nibabel")
    image = nibabel.Nifti1Image(ball.T, [[2, 0, 0, 10], [0, 3, 0, 20], [0, 0, 4, 30], [0, 0, 0, 1]])
    image.header.set_xyzt_units(unit, "sec")
    nibabel.save(image, tmp_path / "ball.nii")
    volume = marrow.as_volume(nibabel.load(tmp_path / "ball.nii"))
    assert np.allclose(volume.affine, marrow.read(tmp_path / "ball.nii").affine, rtol=1e-6)
    assert volume.spacing[0] == pytest.approx(2 * {"meter": 1e3, "micron": 1e-3}.get(unit, 1))


def test_an_image_of_nibabel_without_a_place_is_not_mirrored(ball, tmp_path):
    nibabel = pytest.importorskip("nibabel")
    image = nibabel.Nifti1Image(ball.T, np.diag([2, 3, 4, 1]))
    image.set_sform(None, 0)
    image.set_qform(None, 0)
    nibabel.save(image, tmp_path / "ball.nii")
    with pytest.warns(RuntimeWarning, match="neither sform nor qform"):
        volume = marrow.as_volume(nibabel.load(tmp_path / "ball.nii"))
    own = marrow.read(tmp_path / "ball.nii")
    assert np.array_equal(volume.affine, own.affine) and volume.spacing.tolist() == [2, 3, 4]
    assert "neither sform nor qform" in own.warnings[0]


@pytest.mark.parametrize("kind", ["AnalyzeImage", "Spm99Analyze", "Spm2Analyze"])
def test_an_analyze_image_of_nibabel_has_no_place_but_its_spacing(ball, tmp_path, kind):
    nibabel = pytest.importorskip("nibabel")
    kind = getattr(nibabel, kind, None) or getattr(nibabel, kind.replace("Analyze", "AnalyzeImage"))
    image = kind(ball.T, None)
    image.header.set_zooms((2, 3, 4))
    nibabel.save(image, tmp_path / "ball.img")
    (tmp_path / "ball.mat").unlink(missing_ok=True)
    with pytest.warns(RuntimeWarning, match="Analyze header") as warned:
        volume = marrow.as_volume(kind.load(tmp_path / "ball.img"))
    assert warned[0].filename == __file__
    assert volume.spacing.tolist() == [2, 3, 4] and np.array_equal(volume.direction, np.diag([-1, -1, 1]))
    placed = kind(ball.T, np.array([[2, 0, 0, 10], [0, 3, 0, 20], [0, 0, 4, 30], [0, 0, 0, 1.0]]))
    assert np.allclose(marrow.as_volume(placed).origin, [-10, -20, 30])


def test_an_image_of_nibabel_without_an_affine_is_refused(ball):
    nibabel = pytest.importorskip("nibabel")
    with pytest.raises(marrow.InputError, match="affine"):
        marrow.as_volume(nibabel.Nifti1Image(ball.T, None))


def test_several_volumes_of_nibabel_are_refused(ball):
    nibabel = pytest.importorskip("nibabel")
    image = nibabel.Nifti1Image(np.stack([ball, ball], axis=-1), np.eye(4))
    with pytest.raises(marrow.InputError, match="slicer"):
        marrow.as_volume(image)
    assert marrow.as_volume(image.slicer[..., 1]).shape == ball.T.shape


class ItkImage:
    """As much of an image of ITK's as tells its place; the samples come from functions of its module."""

    def __init__(self, array):
        self.array, self.shape, self.dtype = array, array.shape, array.dtype

    def __getitem__(self, key):
        return self.array[key]

    def GetSpacing(self):
        return (0.5, 1.0, 2.0)

    def GetOrigin(self):
        return (10.0, 20.0, 30.0)


class FakeItk(ItkImage):
    index = (0, 0, 0)

    def GetLargestPossibleRegion(self):
        pass

    def GetBufferedRegion(self):
        return types.SimpleNamespace(GetIndex=lambda: self.index)

    def GetDirection(self):
        vnl = types.SimpleNamespace(rows=lambda: 3, cols=lambda: 3, get=lambda row, column: DIRECTION[row, column])
        return types.SimpleNamespace(GetVnlMatrix=lambda: vnl)


class FakeSimpleItk(ItkImage):
    def GetPixelIDValue(self):
        return 2

    def GetDirection(self):
        return tuple(DIRECTION.ravel())


@pytest.fixture
def itk_images(monkeypatch):
    """Makes stand-ins of the modules of ITK and SimpleITK, and returns the kinds of their images."""
    for kind, module, function in (
        (FakeItk, "itk", "array_view_from_image"),
        (FakeSimpleItk, "SimpleITK", "GetArrayViewFromImage"),
    ):
        fake = types.ModuleType(module)
        setattr(fake, function, lambda image: image.array)
        monkeypatch.setitem(sys.modules, module, fake)
        monkeypatch.setattr(kind, "__module__", f"{module}.images")
    return FakeItk, FakeSimpleItk


@pytest.mark.parametrize("number", [0, 1])
def test_images_of_itk_stay_at_their_place_and_alive(ball, itk_images, number):
    kind = itk_images[number]
    image = kind(ball)
    volume = marrow.as_volume(image)
    assert address(volume) == ball.ctypes.data
    assert np.array_equal(volume.affine[:3, :3], DIRECTION * [0.5, 1, 2])
    assert np.array_equal(volume.origin, (10, 20, 30))
    base = volume.array
    while isinstance(base, np.ndarray):
        base = base.base
    assert base.image is image
    with pytest.raises(marrow.InputError, match="4 axes"):
        marrow.as_volume(kind(ball[..., None]))


def test_a_cropped_image_of_itk_keeps_its_place(ball, itk_images):
    whole, cropped = FakeItk(ball), FakeItk(ball[2:, 3:, 4:])
    cropped.index = (4, 3, 2)  # ITK's filters keep it, with the origin of the whole image
    assert np.allclose(marrow.as_volume(cropped).affine, marrow.as_volume(whole)[2:, 3:, 4:].affine)


@pytest.mark.parametrize("number", [0, 1])
def test_a_colour_image_of_itk_is_refused(ball, itk_images, number, monkeypatch):
    kind = itk_images[number]
    monkeypatch.setattr(kind, "GetSpacing", lambda self: (0.5, 1.0))
    monkeypatch.setattr(kind, "GetDirection", lambda self: (1.0, 0.0, 0.0, 1.0))
    with pytest.raises(marrow.InputError, match="2 axes"):
        marrow.as_volume(kind(ball[:, :, :3]))


def test_coordinates_of_xarray_place_the_samples(ball):
    xarray = pytest.importorskip("xarray")

    coords = dict(z=30 + 2.0 * np.arange(30), y=20 - 1.5 * np.arange(31), x=10 + 0.5 * np.arange(32))
    for dims in (("z", "y", "x"), ("x", "z", "y"), ("X", "Y", "Z")):
        data = ball.transpose(["zyx".index(dim.lower()) for dim in dims])
        volume = marrow.as_volume(xarray.DataArray(data, {dim: coords[dim.lower()] for dim in dims}, dims))
        assert address(volume) == ball.ctypes.data
        for k, j, i in ((0, 0, 0), (3, 4, 5), (29, 30, 31)):
            place = [coords["x"][i], coords["y"][j], coords["z"][k], 1]
            assert np.allclose(volume.affine @ [i, j, k, 1], place)
            assert volume.array[k, j, i] == ball[k, j, i]
    assert np.array_equal(marrow.as_volume(xarray.DataArray(ball, dims=("a", "b", "c"))).affine, np.eye(4))
    coords["y"] = coords["y"] ** 2
    with pytest.raises(marrow.InputError, match="along y"):
        marrow.as_volume(xarray.DataArray(ball, coords, ("z", "y", "x")))
    with pytest.raises(marrow.InputError, match="three"):
        marrow.as_volume(xarray.DataArray(ball[0], dims=("y", "x")))


def test_coordinates_of_xarray_are_lengths(ball):
    xarray = pytest.importorskip("xarray")
    numbers = 1.0 + np.arange(30)
    for unit, mm in (("mm", 1), ("m", 1e3), ("cm", 10), ("micrometer", 1e-3), ("\u00b5m", 1e-3)):
        z = ("z", numbers, {"units": unit})
        volume = marrow.as_volume(xarray.DataArray(ball, {"z": z}, ("z", "y", "x")))
        assert volume.affine[2, 2:].tolist() == pytest.approx([mm, mm])
    dates = np.datetime64("2020-01-01") + np.arange(30)
    degrees, unhashable = ("z", numbers, {"units": "degrees"}), ("z", numbers, {"units": ["mm"]})
    for z in (dates.astype("M8[ns]"), [str(n) for n in numbers], degrees, unhashable):
        with pytest.raises(marrow.InputError, match="along z"):
            marrow.as_volume(xarray.DataArray(ball, {"z": z}, ("z", "y", "x")))


def test_files_of_images_have_their_place(ball, vtk_image, itk_images, tmp_path):
    xarray = pytest.importorskip("xarray")
    pytest.importorskip("dask")
    coords = dict(z=30 + 2.0 * np.arange(30), y=20 - 1.5 * np.arange(31), x=10 + 0.5 * np.arange(32))
    array = xarray.DataArray(ball.transpose(2, 0, 1), coords, ("x", "z", "y"))
    for image in (array, array.chunk(9), vtk_image, *(kind(ball) for kind in itk_images)):
        marrow.extract(image, 300.5).write(tmp_path / "whole.ply")
        marrow.extract_to_file(image, 300.5, tmp_path / "slices.ply")
        assert (tmp_path / "slices.ply").read_bytes() == (tmp_path / "whole.ply").read_bytes()
        with pytest.raises(marrow.InputError, match="do not give others"):
            marrow.extract_to_file(image, 300.5, tmp_path / "slices.ply", spacing=2)


def test_a_stand_in_of_trimesh_gets_points_that_it_must_not_merge(ball, monkeypatch):
    calls = []
    trimesh = types.ModuleType("trimesh")
    trimesh.Trimesh = lambda *arrays, **options: calls.append((arrays, options))
    monkeypatch.setitem(sys.modules, "trimesh", trimesh)
    mesh = marrow.extract(ball, 300.5)
    mesh.to_trimesh()
    (points, triangles), options = calls[0]
    assert points is mesh.points and triangles is mesh.triangles
    assert options["process"] is False and options["vertex_normals"] is mesh.normals


@pytest.mark.parametrize("package", ["pyvista", "meshio", "open3d", "trimesh"])
def test_other_packages_get_the_same_mesh(ball, package):
    pytest.importorskip(package)
    mesh = marrow.extract(ball, 300.5)
    other = getattr(mesh, f"to_{package}")()
    names = dict(pyvista="points", meshio="points", open3d="vertices", trimesh="vertices")
    assert np.array_equal(np.asarray(getattr(other, names[package])), mesh.points)
    triangles = dict(
        pyvista=lambda: other.faces.reshape(-1, 4)[:, 1:],
        meshio=lambda: other.cells_dict["triangle"],
        open3d=lambda: np.asarray(other.triangles),
        trimesh=lambda: other.faces,
    )
    assert np.array_equal(triangles[package](), mesh.triangles)


def test_a_missing_package_is_named(ball, monkeypatch):
    monkeypatch.setitem(sys.modules, "meshio", None)
    with pytest.raises(ImportError, match="meshio"):
        marrow.extract(ball, 300.5).to_meshio()
