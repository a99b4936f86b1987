"""vtkMarrowContour in a pipeline, in place of vtkFlyingEdges3D."""

import numpy as np
import pytest
from marrow_vtk.vtkMarrow import vtkMarrowContour
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand, vtkFloatArray, vtkTypeInt64Array, vtkUnsignedCharArray
from vtkmodules.vtkCommonDataModel import vtkDataObject, vtkImageData, vtkPerlinNoise
from vtkmodules.vtkCommonExecutionModel import vtkTrivialProducer
from vtkmodules.vtkFiltersCore import vtkAppendPolyData, vtkConnectivityFilter, vtkFeatureEdges, vtkFlyingEdges3D
from vtkmodules.vtkImagingCore import vtkImageChangeInformation, vtkRTAnalyticSource
from vtkmodules.vtkImagingHybrid import vtkSampleFunction

DIRECTION = (0, 0.6, 0.8, 1, 0, 0, 0, 0.8, -0.6)


def wavelet():
    source = vtkRTAnalyticSource()
    source.SetWholeExtent(-10, 13, -9, 12, -7, 8)
    return source


def noise():
    """Noise with many ambiguous cells, which is made in pieces."""
    function = vtkPerlinNoise()
    function.SetFrequency(9.1, 8.3, 7.7)
    source = vtkSampleFunction()
    source.SetImplicitFunction(function)
    source.SetSampleDimensions(24, 22, 16)
    source.SetModelBounds(-1, 2, -2, 1, -1, 1.5)
    source.ComputeNormalsOff()
    return source


def image(samples, extent_begin=(5, -7, 11)):
    result = vtkImageData()
    nz, ny, nx = samples.shape
    i, j, k = extent_begin
    result.SetExtent(i, i + nx - 1, j, j + ny - 1, k, k + nz - 1)
    result.SetSpacing(0.5, 1, 2)
    result.SetOrigin(10, 20, 30)
    result.SetDirectionMatrix(*DIRECTION)
    array = numpy_to_vtk(samples.ravel())
    array.SetName("HU")
    result.GetPointData().SetScalars(array)
    return result


def ball(dtype=np.int16, shape=(20, 24, 28)):
    centre = (np.array(shape) - 1) / 2
    index = np.indices(shape) - centre[:, None, None, None]
    samples = 100 - 9 * np.sqrt((index**2).sum(0))
    return (samples + (128 if np.dtype(dtype).kind == "u" else 0)).astype(dtype)


def arrays(surface):
    points = vtk_to_numpy(surface.GetPoints().GetData())
    triangles = vtk_to_numpy(surface.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    normals = surface.GetPointData().GetNormals()
    return points, triangles, None if normals is None else vtk_to_numpy(normals)


def by_id(surface):
    """Return the bytes of each point, its normal and its scalar by global id, and the triangles as global ids."""
    points, triangles, normals = arrays(surface)
    ids = vtk_to_numpy(surface.GetPointData().GetGlobalIds())
    scalars = vtk_to_numpy(surface.GetPointData().GetScalars())
    rows = [part for part in (points, normals, scalars[:, None]) if part is not None]
    return {key: b"".join(part.tobytes() for part in row) for key, *row in zip(ids, *rows)}, [
        tuple(corners) for corners in ids[triangles]
    ]


def extract(source, *values, filter_class=vtkMarrowContour, **settings):
    contour = filter_class()
    if isinstance(source, vtkImageData):
        contour.SetInputData(source)
    else:
        contour.SetInputConnection(source.GetOutputPort())
    for number, value in enumerate(values):
        contour.SetValue(number, value)
    for name, value in settings.items():
        getattr(contour, f"Set{name}")(value)
    contour.Update()
    return contour.GetOutput()


def merged_pieces(contour, pieces, levels=0):
    """Return the points and the triangles of all pieces, as by_id of the whole; points of several pieces are equal.

    Before each piece, the filter before is asked for so many ghost levels, as by another filter that follows it.
    """
    points, triangles = {}, []
    for piece in range(pieces):
        if levels:
            contour.GetInputAlgorithm().UpdatePiece(piece, pieces, levels)
        contour.UpdatePiece(piece, pieces, piece % 3)  # whatever ghost levels the next filter asks for
        if contour.GetOutput().GetNumberOfPoints() == 0:
            continue
        more_points, more_triangles = by_id(contour.GetOutput())
        assert all(points.get(key, bits) == bits for key, bits in more_points.items())
        points.update(more_points)
        triangles += more_triangles
    return points, triangles


def errors_of(contour):
    """Return a list that gets the text of each error."""
    messages = []
    observer = lambda caller, event, text: messages.append(text)  # noqa: E731
    observer.CallDataType = "string0"
    contour.AddObserver(vtkCommand.ErrorEvent, observer)
    return messages


def nearest(points, others):
    """Return for each point the nearest of the others."""
    return np.array([((others - point) ** 2).sum(1).argmin() for point in points])


@pytest.mark.parametrize("dtype", ["u1", "i1", "i2", "u2", "i4", "f4", "f8"])
def test_the_surface_is_that_of_flying_edges(dtype):
    volume = image(ball(dtype))
    level = 40.3 + (128 if dtype[0] == "u" else 0)
    ours, theirs = extract(volume, level), extract(volume, level, filter_class=vtkFlyingEdges3D)
    points, triangles, normals = arrays(ours)
    their_points, their_triangles, their_normals = arrays(theirs)
    assert len(points) == len(their_points) and len(triangles) == len(their_triangles)
    order = nearest(points, their_points)
    assert np.abs(points - their_points[order]).max() < 1e-4
    assert (normals * their_normals[order]).sum(1).min() > 0.99
    corners, their_corners = (p[t].astype(float) for p, t in ((points, triangles), (their_points, their_triangles)))
    volumes = [np.einsum("ij,ij->", c[:, 0], np.cross(c[:, 1], c[:, 2])) for c in (corners, their_corners)]
    assert volumes[0] == pytest.approx(volumes[1], rel=1e-3)  # the same winding
    scalars, their_scalars = (surface.GetPointData().GetScalars() for surface in (ours, theirs))
    assert scalars.GetName() == "HU" and scalars.GetDataType() == their_scalars.GetDataType()
    assert np.array_equal(vtk_to_numpy(scalars), vtk_to_numpy(their_scalars))


def test_axes_with_a_negative_spacing_run_the_other_way():
    volume = image(ball())
    volume.SetSpacing(-0.5, 1, 2)
    points, triangles, normals = arrays(extract(volume, 40.3))
    their_points, *_ = arrays(extract(volume, 40.3, filter_class=vtkFlyingEdges3D))
    assert np.abs(points - their_points[nearest(points, their_points)]).max() < 1e-4
    assert np.abs(their_points - points[nearest(their_points, points)]).max() < 1e-4
    corners = points[triangles] - points.mean(0)
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (across * corners[:, 0]).sum(1).min() > 0  # outward, as the normals
    assert (normals * (points - points.mean(0))).sum(1).min() > 0


@pytest.mark.parametrize("dtype", ["u1", "i2", "i4", "f4"])
def test_scalars_are_the_nearest_that_their_type_has(dtype):
    limits = np.finfo(dtype) if dtype == "f4" else np.iinfo(dtype)
    below = {"u1": -5, "i2": -1e9, "i4": -1e10, "f4": -1e39}[dtype]
    surface = extract(image(ball(dtype)), below, Closed=True)
    scalars = vtk_to_numpy(surface.GetPointData().GetScalars())
    assert len(scalars) > 0 and set(scalars) == {limits.min}


def test_several_values_make_one_output():
    volume = image(ball())
    levels = (20.5, 40.5, 60.5)
    surface = extract(volume, *levels)
    points, triangles, normals = arrays(surface)
    parts = [arrays(extract(volume, level)) for level in levels]
    assert np.array_equal(points, np.concatenate([part[0] for part in parts]))
    assert np.array_equal(normals, np.concatenate([part[2] for part in parts]))
    first = np.cumsum([0] + [len(part[0]) for part in parts])
    assert np.array_equal(triangles, np.concatenate([part[1] + n for part, n in zip(parts, first)]))
    scalars = vtk_to_numpy(surface.GetPointData().GetScalars())
    assert [set(scalars[a:b]) for a, b in zip(first, first[1:])] == [{int(level)} for level in levels]


def test_arrays_can_be_left_out():
    surface = extract(image(ball()), 40.5, ComputeNormals=False, ComputeScalars=False)
    assert surface.GetPointData().GetNumberOfArrays() == 0 and surface.GetNumberOfPolys() > 0


def test_another_array_can_be_chosen():
    volume = image(ball())
    other = numpy_to_vtk(-ball().ravel())
    other.SetName("negative")
    volume.GetPointData().AddArray(other)
    contour = vtkMarrowContour()
    contour.SetInputData(volume)
    contour.SetInputArrayToProcess(0, 0, 0, vtkDataObject.FIELD_ASSOCIATION_POINTS, "negative")
    contour.SetValue(0, -40.5)
    contour.Update()
    assert contour.GetOutput().GetPointData().GetScalars().GetName() == "negative"
    assert contour.GetOutput().GetNumberOfPoints() == extract(volume, 40.5).GetNumberOfPoints()


def test_the_border_can_be_closed():
    volume = image(ball())

    def open_edges(**settings):
        edges = vtkFeatureEdges()
        edges.SetInputData(extract(volume, -30.5, **settings))
        edges.FeatureEdgesOff()
        edges.NonManifoldEdgesOn()
        edges.Update()
        return edges.GetOutput().GetNumberOfCells()

    assert open_edges() > 0 and open_edges(Closed=True) == 0


def test_exact_topology_joins_samples_across_a_diagonal():
    # At its saddle, the interpolant between the four samples is (50 * 50 - 20 * 20) / 140 > 0.
    wall = image(np.array([[[50, -20], [-20, 50]]] * 3, np.int16))

    def components(**settings):
        connected = vtkConnectivityFilter()
        connected.SetInputData(extract(wall, 0, Closed=True, **settings))
        connected.SetExtractionModeToAllRegions()
        connected.Update()
        return connected.GetNumberOfExtractedRegions()

    assert components() == 2 and components(ExactTopology=True) == 1
    several = extract(wall, 0, 10, Closed=True, ExactTopology=True)
    assert several.GetNumberOfPoints() > extract(wall, 0, Closed=True, ExactTopology=True).GetNumberOfPoints()


@pytest.mark.parametrize("pieces", [2, 3, 4, 7, 30])
@pytest.mark.parametrize("settings", [{}, {"Closed": True}, {"ComputeNormals": False}])
@pytest.mark.parametrize("exact", [False, True])
def test_pieces_have_the_bits_of_the_whole(pieces, settings, exact):
    """Merged by their global ids, the pieces are the whole: all points, and each triangle once."""
    source = noise() if exact else wavelet()
    levels = (0.02, -0.1) if exact else (150.3, 190.1)
    settings = {**settings, "ExactTopology": exact}
    expected = by_id(extract(source, *levels, ComputeGlobalIds=True, **settings))
    separated = extract(source, *levels, **{**settings, "ExactTopology": False})
    assert (len(expected[0]) > separated.GetNumberOfPoints()) == exact  # points inside cells
    contour = vtkMarrowContour()
    contour.SetInputConnection(source.GetOutputPort())
    contour.SetComputeGlobalIds(True)
    for number, level in enumerate(levels):
        contour.SetValue(number, level)
    for name, value in settings.items():
        getattr(contour, f"Set{name}")(value)
    points, triangles = merged_pieces(contour, pieces)
    assert points == expected[0]
    assert sorted(triangles) == sorted(expected[1])


@pytest.mark.parametrize("pieces", [2, 3, 7, 30])
@pytest.mark.parametrize("normals", [False, True])
@pytest.mark.parametrize("shift", [(0, 0, 0), (5, -7, 100)])
@pytest.mark.parametrize("levels", [0, 2])
def test_pieces_behind_a_filter_that_drops_the_ghost_array_are_those_of_the_whole(pieces, normals, shift, levels):
    source, moved = wavelet(), vtkImageChangeInformation()
    moved.SetInputConnection(source.GetOutputPort())
    moved.SetOutputSpacing(0.5, 1, 2)
    moved.SetExtentTranslation(*shift)
    settings = {"ComputeGlobalIds": True, "ComputeNormals": normals}
    expected_points, expected_triangles = by_id(extract(moved, 150.3, **settings))
    contour = vtkMarrowContour()
    contour.SetInputConnection(moved.GetOutputPort())
    contour.SetValue(0, 150.3)
    for name, value in settings.items():
        getattr(contour, f"Set{name}")(value)
    errors = errors_of(contour)
    points, triangles = merged_pieces(contour, pieces, levels)
    assert not errors and moved.GetOutput().GetCellGhostArray() is None
    assert points == expected_points
    assert sorted(triangles) == sorted(expected_triangles)


def test_global_ids_ascend_and_change_nothing_else():
    volume = image(ball())
    plain, with_ids = extract(volume, 40.5), extract(volume, 40.5, ComputeGlobalIds=True)
    ids = vtk_to_numpy(with_ids.GetPointData().GetGlobalIds())
    assert plain.GetPointData().GetGlobalIds() is None and (np.diff(ids) > 0).all()
    for a, b in zip(arrays(plain), arrays(with_ids)):
        assert np.array_equal(a, b)
    two = extract(volume, 40.5, 40.5, ComputeGlobalIds=True)
    edges = 3 * 20 * 24 * 28
    assert np.array_equal(vtk_to_numpy(two.GetPointData().GetGlobalIds()), np.concatenate([ids, ids + edges]))


def test_ranks_without_data_have_no_surface_and_no_error():
    empty = vtkImageData()
    errors = []
    contour = vtkMarrowContour()
    contour.AddObserver(vtkCommand.ErrorEvent, lambda *_: errors.append(1))
    contour.SetInputData(empty)
    contour.SetValue(0, 1)
    contour.Update()
    contour.SetInputData(image(ball()))
    contour.SetValue(0, 1e6)
    contour.Update()
    assert contour.GetOutput().GetNumberOfPoints() == 0 and not errors


@pytest.mark.parametrize("values", [0, 1, 100, 20000])
def test_a_ghost_array_has_one_value_for_each_cell(values):
    volume = image(ball())
    ghosts = vtkUnsignedCharArray()
    ghosts.SetName("vtkGhostType")
    ghosts.SetNumberOfTuples(values)
    ghosts.Fill(0)
    volume.GetCellData().AddArray(ghosts)
    contour = vtkMarrowContour()
    contour.SetInputData(volume)
    contour.SetValue(0, 40.5)
    errors = errors_of(contour)
    contour.Update()
    (error,) = errors
    assert f"vtkGhostType has {values} values for {volume.GetNumberOfCells()} cells; " in error
    assert contour.GetOutput().GetNumberOfPoints() == 0


def test_a_piece_without_samples_around_it_has_no_normals():
    part = vtkTrivialProducer()
    part.SetOutput(image(ball(), (0, 0, 0)))
    part.SetWholeExtent(0, 27, 0, 40, 0, 19)
    contour = vtkMarrowContour()
    contour.SetInputConnection(part.GetOutputPort())
    contour.SetValue(0, 40.5)
    errors = errors_of(contour)
    contour.Update()
    (error,) = errors
    assert "none along axis 1; give it one, or turn ComputeNormals off" in error
    contour.ComputeNormalsOff()
    contour.Update()
    assert len(errors) == 1 and contour.GetOutput().GetNumberOfPoints() > 0


def test_what_cannot_be_read_is_refused_in_one_line():
    def message_of(volume, **settings):
        contour = vtkMarrowContour()
        messages = errors_of(contour)
        contour.SetInputData(volume)
        contour.SetValue(0, 1)
        for name, value in settings.items():
            getattr(contour, f"Set{name}")(*value)
        contour.Update()
        return messages[-1] if messages else ""

    vectors = image(ball())
    vectors.GetPointData().SetScalars(numpy_to_vtk(np.zeros((vectors.GetNumberOfPoints(), 3))))
    assert "3 components" in message_of(vectors)
    flat = image(ball())
    flat.SetSpacing(0, 1, 1)
    assert "spacing" in message_of(flat)
    long = image(ball())
    array = vtkTypeInt64Array()
    array.SetNumberOfValues(long.GetNumberOfPoints())
    long.GetPointData().SetScalars(array)
    assert "vtkImageCast" in message_of(long)
    cells = image(ball())
    of_cells = numpy_to_vtk(np.zeros(cells.GetNumberOfCells()))
    of_cells.SetName("of cells")
    cells.GetCellData().AddArray(of_cells)
    chosen = (0, 0, 0, vtkDataObject.FIELD_ASSOCIATION_CELLS, "of cells")
    assert "vtkCellDataToPointData" in message_of(cells, InputArrayToProcess=chosen)


def test_arrays_outlive_the_filter_and_the_input():
    points, triangles, normals = arrays(extract(image(ball()), 40.5))
    again, _, _ = arrays(extract(image(ball()), 40.5))
    assert np.array_equal(points, again) and triangles.max() == len(points) - 1
    assert np.allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-5)


def test_shallow_copies_of_arrays_outlive_them():
    normals = extract(image(ball()), 40.5).GetPointData().GetNormals()
    expected, copy = np.array(vtk_to_numpy(normals)), vtkFloatArray()
    copy.ShallowCopy(normals)
    del normals
    extract(image(ball()), 60.5)  # takes the memory if it is free
    assert np.array_equal(vtk_to_numpy(copy), expected)


def test_a_changed_value_runs_the_filter_again():
    contour = vtkMarrowContour()
    contour.SetInputData(image(ball()))
    counts = []
    for value in (40.5, 60.5, 60.5):
        contour.SetValue(0, value)
        contour.Update()
        counts.append(contour.GetOutput().GetNumberOfPoints())
    assert counts[0] > counts[1] == counts[2] > 0


def test_observers_see_progress_and_can_abort():
    samples = ball(np.float32, (300, 300, 300))
    contour = vtkMarrowContour()
    contour.SetInputData(image(samples))
    for number in range(60):
        contour.SetValue(number, -900 + 16 * number)
    seen = []

    def observe(caller, event):
        seen.append(caller.GetProgress())
        if caller.GetProgress() > 0.1:
            caller.SetAbortExecute(1)

    contour.AddObserver(vtkCommand.ProgressEvent, observe)
    contour.Update()
    assert contour.GetOutput().GetNumberOfPoints() == 0
    assert any(0.1 < fraction < 0.9 for fraction in seen)
