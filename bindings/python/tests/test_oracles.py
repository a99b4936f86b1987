"""Scans, filters and DICOM objects against other programs: nibabel, pydicom and VTK."""

import os
import pathlib
import struct

import marrow
import numpy as np
import pytest

FLIP = np.diag([-1, -1, 1, 1])  # from RAS, the space of NIfTI, to LPS
TYPES = ["uint8", "int8", "int16", "uint16", "int32", "float32", "float64"]


def samples(dtype, shape=(5, 6, 7)):
    """Different values over the range of the type, as far as it is exact in float32."""
    rng = np.random.default_rng(3)
    info = np.iinfo(dtype) if np.dtype(dtype).kind in "iu" else None
    low, high = (max(info.min, -(2**20)), min(info.max, 2**20)) if info else (-1000, 1000)
    return rng.integers(low, high, shape, endpoint=True).astype(dtype)


def vtk_array(image):
    """The samples of a vtkImageData, as (nz, ny, nx)."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    values = vtk_to_numpy(image.GetPointData().GetScalars())
    channel = values[:, 0] if values.ndim == 2 else values  # VTK gives grey BMP as RGB
    return channel.reshape(image.GetDimensions()[::-1])


def vtk_image(array, spacing=(1, 1, 1)):
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonDataModel import vtkImageData

    image = vtkImageData()
    image.SetDimensions(array.shape[::-1])
    image.SetSpacing(spacing)
    image.GetPointData().SetScalars(numpy_to_vtk(np.ascontiguousarray(array).ravel(), deep=True))
    return image


def read_by_vtk(reader, path):
    reader.SetFileName(str(path))
    reader.Update()
    return reader.GetOutput()


# ---- NIfTI ----

OBLIQUE = np.array([[-0.8, 0.36, 0.96, 10], [0.3, 1.44, -0.28, -20], [0, 0.6, 1.3, 30], [0, 0, 0, 1]])
ORTHOGONAL = np.array([[0, 0, 1.5, 10], [0, -2, 0, 20], [0.7, 0, 0, -30], [0, 0, 0, 1]])  # as a qform can be


@pytest.mark.parametrize("kind", ["Nifti1Image", "Nifti2Image", "Nifti1Pair"])
@pytest.mark.parametrize("dtype", TYPES)
@pytest.mark.parametrize("order", ["<", ">"])
def test_nifti_as_nibabel_writes_it(tmp_path, kind, dtype, order):
    nibabel = pytest.importorskip("nibabel")
    data = samples(dtype)
    header = getattr(nibabel, kind).header_class(endianness=order)
    image = getattr(nibabel, kind)(data.astype(data.dtype.newbyteorder(order)), OBLIQUE, header)
    image.header.set_data_dtype(data.dtype.newbyteorder(order))
    image.header.set_xyzt_units("mm")
    path = tmp_path / ("a.img" if kind == "Nifti1Pair" else "a.nii.gz")
    nibabel.save(image, path)
    scan = marrow.read(path.with_suffix(".hdr") if kind == "Nifti1Pair" else path)
    assert np.array_equal(scan.array, data.transpose())
    assert scan.dtype == data.dtype
    assert np.allclose(scan.affine, FLIP @ nibabel.load(path).affine, atol=1e-5)


@pytest.mark.parametrize("forms", [(0, 1), (1, 0), (1, 2)])
def test_sform_and_qform_as_nibabel_chooses_them(tmp_path, forms):
    nibabel = pytest.importorskip("nibabel")
    image = nibabel.Nifti1Image(samples("int16"), None)
    image.header.set_xyzt_units("mm")
    image.set_sform(OBLIQUE, forms[0])
    image.set_qform(ORTHOGONAL, forms[1])
    nibabel.save(image, tmp_path / "a.nii")
    read = nibabel.load(tmp_path / "a.nii").affine
    assert np.allclose(read, OBLIQUE if forms[0] else ORTHOGONAL, atol=1e-2), "quaternions are stored as float32"
    assert np.allclose(marrow.read(tmp_path / "a.nii").affine, FLIP @ read, atol=1e-5)


def test_scaled_nifti_as_nibabel_reads_it(tmp_path):
    nibabel = pytest.importorskip("nibabel")
    image = nibabel.Nifti1Image(samples("int16"), OBLIQUE)
    image.header.set_xyzt_units("mm")
    image.header.set_slope_inter(0.37, -12.5)
    nibabel.save(image, tmp_path / "a.nii")
    read = nibabel.load(tmp_path / "a.nii")
    scan = marrow.read(tmp_path / "a.nii")
    assert scan.dtype == np.float32
    assert np.allclose(scan.array, read.get_fdata().transpose(), rtol=1e-6)


def test_volumes_of_nifti_as_nibabel_reads_them(tmp_path):
    nibabel = pytest.importorskip("nibabel")
    data = samples("int16", (4, 5, 6, 3))
    image = nibabel.Nifti1Image(data, OBLIQUE)
    image.header.set_xyzt_units("mm")
    nibabel.save(image, tmp_path / "a.nii")
    for k in range(3):
        assert np.array_equal(marrow.read(tmp_path / "a.nii", volume=k).array, data[..., k].transpose())


# ---- VTK's readers and writers of images ----


@pytest.mark.parametrize("dtype", TYPES)
def test_volumes_as_vtk_reads_them(tmp_path, dtype):
    io = pytest.importorskip("vtkmodules.vtkIOImage")
    nibabel = pytest.importorskip("nibabel")
    from vtkmodules.util.numpy_support import vtk_to_numpy

    data = samples(dtype)
    image = nibabel.Nifti1Image(data.transpose(), np.diag([0.5, 2, 3, 1]))
    image.header.set_xyzt_units("mm")
    nibabel.save(image, tmp_path / "a.nii")
    names = {"uint8": "uchar", "int8": "signed char", "int16": "short", "uint16": "ushort", "int32": "int",
             "float32": "float", "float64": "double"}  # fmt: skip
    head = f"NRRD0004\ntype: {names[dtype]}\ndimension: 3\nsizes: 7 6 5\nkinds: domain domain domain\nspacings: 0.5 2 3\nencoding: raw\n"
    (tmp_path / "a.nrrd").write_bytes(f"{head}endian: little\n\n".encode() + data.tobytes())
    types = {"uint8": "UCHAR", "int8": "CHAR", "int16": "SHORT", "uint16": "USHORT", "int32": "INT",
             "float32": "FLOAT", "float64": "DOUBLE"}  # fmt: skip
    meta = f"ObjectType = Image\nNDims = 3\nDimSize = 7 6 5\nElementType = MET_{types[dtype]}\n"
    meta += "ElementSpacing = 0.5 2 3\nOffset = 4 5 6\nElementByteOrderMSB = True\nElementDataFile = LOCAL\n"
    (tmp_path / "a.mha").write_bytes(meta.encode() + data.byteswap().tobytes())
    readers = {"a.nii": io.vtkNIFTIImageReader(), "a.nrrd": io.vtkNrrdReader(), "a.mha": io.vtkMetaImageReader()}
    for name, reader in readers.items():
        read = read_by_vtk(reader, tmp_path / name)
        scan = marrow.read(tmp_path / name)
        assert np.array_equal(scan.array, data), name
        if name == "a.nrrd":  # VTK 9.1 takes its first axis for components
            assert np.array_equal(vtk_to_numpy(read.GetPointData().GetScalars()).ravel(), data.ravel())
            continue
        assert np.array_equal(vtk_array(read), data), name
        assert np.allclose(scan.spacing, read.GetSpacing()), name
    assert np.allclose(scan.origin, read.GetOrigin())


@pytest.mark.parametrize("compressed", [False, True])
def test_metaimage_as_vtk_writes_it(tmp_path, compressed):
    io = pytest.importorskip("vtkmodules.vtkIOImage")
    data = samples("int16")
    writer = io.vtkMetaImageWriter()
    writer.SetInputData(vtk_image(data, (0.5, 2, 3)))
    writer.SetFileName(str(tmp_path / "a.mhd"))
    writer.SetRAWFileName(str(tmp_path / ("a.zraw" if compressed else "a.raw")))
    writer.SetCompression(compressed)
    writer.Write()
    scan = marrow.read(tmp_path / "a.mhd")
    assert np.array_equal(scan.array, data)
    assert np.allclose(scan.spacing, (0.5, 2, 3))


@pytest.mark.parametrize("name", ["PNG", "TIFF", "BMP", "JPEG"])
@pytest.mark.parametrize("dtype", ["uint8", "uint16"])
def test_slices_as_vtk_writes_and_reads_them(tmp_path, name, dtype):
    io = pytest.importorskip("vtkmodules.vtkIOImage")
    if dtype == "uint16" and name in ("BMP", "JPEG"):
        pytest.skip("the format has 8 bits")
    extension = {"PNG": ".png", "TIFF": ".tif", "BMP": ".bmp", "JPEG": ".jpg"}[name]
    data = samples(dtype)
    writer = getattr(io, f"vtk{name}Writer")()
    for k in range(5):
        writer.SetInputData(vtk_image(data[k : k + 1]))
        writer.SetFileName(str(tmp_path / f"slice{k}{extension}"))
        writer.Write()
    scan = marrow.read(tmp_path, spacing=(1, 1, 1))
    for k in range(5):
        reader = getattr(io, f"vtk{name}Reader")()
        if name == "TIFF":
            reader.SetOrientationType(4)  # as for the other formats: the first row is at the bottom
        read = vtk_array(read_by_vtk(reader, tmp_path / f"slice{k}{extension}"))
        assert np.array_equal(scan.array[k], read[0, ::-1]), (name, k)
        if name != "JPEG":
            assert np.array_equal(read[0], data[k])


@pytest.mark.parametrize("orientation", range(1, 9))
def test_tiff_is_upright(tmp_path, orientation):
    io = pytest.importorskip("vtkmodules.vtkIOImage")
    data = samples("uint16")
    writer = io.vtkTIFFWriter()
    writer.SetInputData(vtk_image(data[:1]))
    writer.SetCompression(0)
    writer.SetFileName(str(tmp_path / "a.tif"))
    writer.Write()
    bytes = (tmp_path / "a.tif").read_bytes()
    tag = struct.pack("<HHI", 274, 3, 1)
    assert bytes.count(tag) == 1
    (tmp_path / "a.tif").write_bytes(bytes.replace(tag + b"\x01", tag + orientation.to_bytes(1, "little")))
    if orientation in (1, 4):
        rows = data[0] if orientation == 4 else data[0, ::-1]
        assert np.array_equal(marrow.read(tmp_path / "a.tif", spacing=(1, 1, 1)).array[0], rows)
    else:
        with pytest.raises(marrow.InputError, match="mirrored or turned"):
            marrow.read(tmp_path / "a.tif", spacing=(1, 1, 1))


# ---- DICOM ----


def write_dicom(pydicom, folder, values, *, syntax="1.2.840.10008.1.2.1", bits=16, rescale=(1, 0), compress=False):
    """A CT of the slices `values`, (nz, ny, nx), on an oblique grid."""
    from pydicom.dataset import FileDataset, FileMetaDataset
    from pydicom.uid import RLELossless, generate_uid

    folder.mkdir()
    series, study, frame = generate_uid(), generate_uid(), generate_uid()
    row, column = np.array([0.8, 0.6, 0]), np.array([-0.6, 0.8, 0])
    for k, plane in enumerate(values):
        meta = FileMetaDataset()
        meta.TransferSyntaxUID = syntax
        meta.MediaStorageSOPClassUID = "1.2.840.10008.5.1.4.1.1.2"
        meta.MediaStorageSOPInstanceUID = generate_uid()
        ds = FileDataset("", {}, file_meta=meta, preamble=b"\0" * 128)
        ds.SOPClassUID, ds.SOPInstanceUID = meta.MediaStorageSOPClassUID, meta.MediaStorageSOPInstanceUID
        ds.SeriesInstanceUID, ds.StudyInstanceUID, ds.FrameOfReferenceUID = series, study, frame
        ds.Modality, ds.PatientName, ds.PatientID = "CT", "SECRET^NAME", "4711"
        ds.Rows, ds.Columns = plane.shape
        ds.SamplesPerPixel, ds.PhotometricInterpretation = 1, "MONOCHROME2"
        ds.BitsAllocated, ds.BitsStored, ds.HighBit = 8 * plane.itemsize, bits, bits - 1
        ds.PixelRepresentation = int(plane.dtype.kind == "i")
        ds.PixelSpacing = [2, 0.5]
        ds.ImageOrientationPatient = [*row, *column]
        ds.ImagePositionPatient = [float(x) for x in np.array([10, 20, 30]) + 1.5 * k * np.cross(row, column)]
        ds.RescaleSlope, ds.RescaleIntercept = rescale
        ds.InstanceNumber = len(values) - k
        little = not syntax.endswith(".2.2")
        ds.is_little_endian, ds.is_implicit_VR = little, syntax.endswith("10008.1.2")
        ds.PixelData = plane.astype(plane.dtype.newbyteorder("<" if little else ">")).tobytes()
        ds["PixelData"].VR = "OB" if plane.itemsize == 1 else "OW"
        if compress:
            ds.compress(RLELossless)
        ds.save_as(folder / f"{k}.dcm", write_like_original=False)


def write_segmentation(pydicom, folder, labels, segments):
    """A label map of 1 mm samples, whose segments have names, and colours as DICOM writes CIELab, or None."""

    def items(**attributes):
        item = pydicom.Dataset()
        for name, value in attributes.items():
            setattr(item, name, value)
        return [item]

    write_dicom(pydicom, folder, labels[:1], bits=8)
    ds = pydicom.dcmread(folder / "0.dcm")
    for name in ("PixelSpacing", "ImageOrientationPatient", "ImagePositionPatient", "RescaleSlope", "RescaleIntercept"):
        delattr(ds, name)
    ds.SOPClassUID = ds.file_meta.MediaStorageSOPClassUID = "1.2.840.10008.5.1.4.1.1.66.7"
    ds.Modality, ds.SegmentationType, ds.NumberOfFrames, ds.PixelData = "SEG", "LABELMAP", len(labels), labels.tobytes()
    ds.SegmentSequence = []
    for number, (name, colour) in segments.items():
        ds.SegmentSequence += items(SegmentNumber=number, SegmentLabel=name)
        if colour:
            ds.SegmentSequence[-1].RecommendedDisplayCIELabValue = colour
    ds.SharedFunctionalGroupsSequence = items(
        PlaneOrientationSequence=items(ImageOrientationPatient=[1, 0, 0, 0, 1, 0]),
        PixelMeasuresSequence=items(PixelSpacing=[1, 1], SpacingBetweenSlices=1),
    )
    ds.PerFrameFunctionalGroupsSequence = [
        item
        for k in range(len(labels))
        for item in items(PlanePositionSequence=items(ImagePositionPatient=[0, 0, k]))
    ]
    ds.save_as(folder / "0.dcm")


CASES = {
    "implicit": dict(syntax="1.2.840.10008.1.2"),
    "explicit": dict(),
    "big-endian": dict(syntax="1.2.840.10008.1.2.2"),
    "deflated": dict(syntax="1.2.840.10008.1.2.1.99"),
    "run-length": dict(compress=True),
    "rescaled": dict(rescale=(2, -1024)),
    "fractional": dict(rescale=(0.25, 3.5)),
    "12 bits": dict(bits=12),
}


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("dtype", ["int16", "uint16", "uint8"])
def test_dicom_as_pydicom_writes_and_reads_it(tmp_path, case, dtype):
    pydicom = pytest.importorskip("pydicom")
    options = dict(CASES[case])
    if dtype == "uint8":
        options["bits"] = 8
    bits = options.setdefault("bits", 16)
    data = samples(dtype)
    if bits == 12:
        data = data % 4096 if dtype == "uint16" else data // 16
    write_dicom(pydicom, tmp_path / "ct", data.astype(dtype), **options)
    scan = marrow.read(tmp_path / "ct")
    for k in range(len(data)):
        ds = pydicom.dcmread(tmp_path / "ct" / f"{k}.dcm")
        values = ds.pixel_array * float(ds.RescaleSlope) + float(ds.RescaleIntercept)
        assert np.array_equal(scan.array[k], values)
        first = scan.affine @ [0, 0, k, 1]
        assert np.allclose(first[:3], np.array(ds.ImagePositionPatient, float), atol=1e-6)
    along_row = scan.affine[:3, 0]
    assert np.allclose(along_row, 0.5 * np.array([0.8, 0.6, 0])), "the second value of PixelSpacing"


def test_a_series_is_chosen_and_resampled(tmp_path):
    pydicom = pytest.importorskip("pydicom")
    first, second = samples("int16"), samples("int16")[:, ::-1]
    write_dicom(pydicom, tmp_path / "a", first)
    write_dicom(pydicom, tmp_path / "b", second)
    ids = [pydicom.dcmread(tmp_path / name / "0.dcm").SeriesInstanceUID for name in "ab"]
    with pytest.raises(marrow.InputError, match="series"):
        marrow.read(tmp_path)
    for uid, values in zip(ids, (first, second)):
        assert np.array_equal(marrow.read(tmp_path, series=uid).array, values)
        report = marrow.inspect(tmp_path, series=uid)
        assert report.series[report.chosen].series.id == uid
    for index, series in enumerate(marrow.inspect(tmp_path).series):
        for number in (index + 1, np.int64(index + 1), str(index + 1)):
            assert marrow.read(tmp_path, series=number).info.series.id == series.series.id
            assert marrow.inspect(tmp_path, series=number).chosen == index
    (tmp_path / "b" / "2.dcm").unlink()
    with pytest.raises(marrow.GeometryError):
        marrow.read(tmp_path / "b")
    assert marrow.read(tmp_path / "b", resample=True).shape == second.shape
    assert marrow.inspect(tmp_path / "b", resample=True).series[0].refusal is None


def test_otsu_and_the_histogram_leave_padding_out(tmp_path):
    pydicom = pytest.importorskip("pydicom")
    values = np.where(np.arange(12) < 6, 100, 300) * np.ones((5, 11, 1), np.int16)
    values[:, :4] = -2000
    write_dicom(pydicom, tmp_path / "ct", values.astype(np.int16))
    for file in (tmp_path / "ct").iterdir():
        ds = pydicom.dcmread(file)
        ds.add_new("PixelPaddingValue", "SS", -2000)
        ds.save_as(file)
    scan = marrow.read(tmp_path / "ct")
    assert scan.info.padding == -2000
    assert 100 < marrow.otsu(scan) <= 300
    assert marrow.extract(scan, "otsu").measure().triangles > 0
    counts = marrow.histogram(scan)
    assert counts.edges[0] == 100 and counts.counts.sum() == np.count_nonzero(values > -2000)


def test_labels_of_a_segmentation_have_the_names_and_colours_of_its_segments(tmp_path):
    pydicom = pytest.importorskip("pydicom")
    labels = np.zeros((8, 9, 10), np.uint8)
    labels[2:6, 2:4, 2:8], labels[2:6, 4:7, 2:8], labels[6, 2:7, 2:8] = 1, 2, 4
    grey = [32768, 32896, 32896]  # L 50, a 0, b 0
    segments = {1: ("liver", grey), 2: ("left kidney", None), 3: ("rib", grey)}
    write_segmentation(pydicom, tmp_path / "seg", labels, segments)
    scan = marrow.read(tmp_path / "seg")
    assert np.array_equal(scan.array, labels)
    table = scan.info.series.labels
    assert {label: entry.name for label, entry in table.items()} == {1: "liver", 2: "left kidney", 3: "rib"}
    assert table[1].colour == pytest.approx([119 / 255] * 3, abs=0.01) and table[2].colour is None
    series = marrow.inspect(tmp_path / "seg").series[0].series
    assert series.labels == table and hash(series) == hash(marrow.inspect(tmp_path / "seg").series[0].series)

    meshes = marrow.labels(scan)
    assert {label: mesh.name for label, mesh in meshes.items()} == {1: "liver", 2: "left kidney", 4: "label-4"}
    unnamed = marrow.labels(labels)
    assert meshes[1].colour == table[1].colour and meshes[2].colour == unnamed[2].colour
    given = marrow.labels(scan, table={1: marrow.LabelEntry("hepar", (1, 0, 0)), 4: marrow.LabelEntry("spleen")})
    assert [mesh.name for mesh in given.values()] == ["hepar", "left kidney", "spleen"]
    assert given[1].colour == (1, 0, 0)
    renamed = marrow.labels(scan, table={1: marrow.LabelEntry("hepar")})[1]
    assert (renamed.name, renamed.colour) == ("hepar", table[1].colour)
    assert scan.info.series.labels == table


def test_real_dicom_as_pydicom_reads_it():
    pydicom = pytest.importorskip("pydicom")
    root = os.environ.get("MARROW_TEST_DATA")
    folder = pathlib.Path(root, "vhf_head_ct", "Head") if root else None
    if not folder or not folder.is_dir():
        pytest.skip("MARROW_TEST_DATA has no vhf_head_ct")
    scan = marrow.read(folder)
    files = [pydicom.dcmread(f) for f in folder.rglob("*") if f.is_file()]
    files = [ds for ds in files if "PixelData" in ds and ds.SeriesInstanceUID == files[0].SeriesInstanceUID]
    files.sort(key=lambda ds: float(ds.ImagePositionPatient[2]))
    assert len(files) == scan.shape[0]
    for k in range(0, len(files), 20):
        ds = files[k]
        assert np.array_equal(scan.array[k], ds.pixel_array * float(ds.RescaleSlope) + float(ds.RescaleIntercept))
        assert np.allclose((scan.affine @ [0, 0, k, 1])[:3], np.array(ds.ImagePositionPatient, float), atol=1e-3)


def test_pydicom_reads_a_mesh_in_dicom(ball, tmp_path):
    pydicom = pytest.importorskip("pydicom")
    mesh = marrow.extract(ball, 300.5)
    mesh.write(tmp_path / "a.stl")
    mesh.write(tmp_path / "a.dcm", verify=True)
    ds = pydicom.dcmread(tmp_path / "a.dcm")
    assert ds.SOPClassUID == "1.2.840.10008.5.1.4.1.1.104.3"
    assert ds.EncapsulatedDocument == (tmp_path / "a.stl").read_bytes()
    assert ds.EncapsulatedDocumentLength == len(ds.EncapsulatedDocument)
    assert ds.MIMETypeOfEncapsulatedDocument == "model/stl"
    assert ds.MeasurementUnitsCodeSequence[0].CodeValue == "mm"
    assert ds.PatientName == "" and ds.PatientIdentityRemoved == "YES"
    with pytest.raises(marrow.InputError):
        mesh.write(tmp_path / "b.dcm", space="RAS")


# ---- filters ----


@pytest.mark.parametrize("radius", [1, 2])
@pytest.mark.parametrize("dtype", ["int16", "float32"])
def test_the_median_is_vtks(radius, dtype):
    general = pytest.importorskip("vtkmodules.vtkImagingGeneral")
    data = samples(dtype, (12, 13, 14))
    median = general.vtkImageMedian3D()
    median.SetKernelSize(*[2 * radius + 1] * 3)
    median.SetInputData(vtk_image(data))
    median.Update()
    expected = vtk_array(median.GetOutput())
    found = marrow.median_filter(data, radius).array
    inside = (slice(radius, -radius),) * 3
    assert np.array_equal(found[inside], expected[inside])
    # Windows at the border have even numbers of samples, and there are two middle ones.
    assert np.mean(found == expected) > 0.3


@pytest.mark.parametrize("spacing", [(1, 1, 1), (0.5, 1, 2)])
def test_the_gaussian_is_vtks(spacing):
    general = pytest.importorskip("vtkmodules.vtkImagingGeneral")
    data = samples("float32", (20, 21, 22))
    sigma = 0.9
    gauss = general.vtkImageGaussianSmooth()
    gauss.SetDimensionality(3)
    gauss.SetStandardDeviations(*[sigma / s for s in spacing])
    gauss.SetRadiusFactors(4, 4, 4)
    gauss.SetInputData(vtk_image(data))
    gauss.Update()
    expected = vtk_array(gauss.GetOutput())
    found = marrow.gaussian_filter(marrow.Volume(data, spacing=spacing), sigma).array
    assert np.allclose(found, expected, rtol=0, atol=2e-4 * np.abs(data).max())
