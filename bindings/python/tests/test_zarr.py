"""OME-Zarr images and Zarr arrays, compared with zarr-python, and with files made by hand for version 3."""

import itertools
import json
import struct

import marrow
import numpy as np
import pytest

zarr = pytest.importorskip("zarr")
numcodecs = pytest.importorskip("numcodecs")


def crc32c(data):
    value = 0xFFFFFFFF
    for byte in data:
        value ^= byte
        for _ in range(8):
            value = value >> 1 ^ (0x82F63B78 if value & 1 else 0)
    return struct.pack("<I", value ^ 0xFFFFFFFF)


def random_samples(rng, shape, dtype):
    values = rng.integers(0, 100, shape) if dtype.kind == "u" else rng.integers(-50, 50, shape)
    return values.astype(dtype)


def scale(*numbers):
    return [{"type": "scale", "scale": list(numbers)}]


def axes(names, unit="micrometer"):
    kinds = {"t": "time", "c": "channel"}
    return [
        {"name": name, "type": kinds.get(name, "space"), **({"unit": unit} if name in "xyz" and unit else {})}
        for name in names
    ]


def write_image(folder, levels, names="zyx", unit="micrometer", spacing=(1.0,), **more):
    """Write the metadata of OME-Zarr 0.4 around arrays of zarr-python."""
    zarr.open_group(str(folder), mode="w")
    datasets = []
    for number, level in enumerate(levels):
        zarr.save_array(str(folder / str(number)), level, chunks=(3,) * level.ndim)
        factor = 2**number
        numbers = [1.0] * (level.ndim - 3) + [factor * s for s in (spacing * 3)[:3]]
        datasets.append({"path": str(number), "coordinateTransformations": scale(*numbers)})
    image = {"version": "0.4", "axes": axes(names, unit), "datasets": datasets, **more}
    (folder / ".zattrs").write_text(json.dumps({"multiscales": [image]}))


COMPRESSORS = [
    None,
    numcodecs.Zlib(),
    numcodecs.GZip(),
    numcodecs.Zstd(),
    numcodecs.LZ4(),
    *(
        numcodecs.Blosc(name, shuffle=shuffle)
        for name, shuffle in (("lz4", 1), ("zstd", 2), ("blosclz", 0), ("zlib", 1), ("lz4hc", 1))
    ),
]
TYPES = ["|u1", "|i1", "<i2", ">i2", "<u2", ">u2", "<i4", ">i4", "<u4", "<i8", ">u8", "<f4", ">f4", "<f8"]


@pytest.mark.parametrize("compressor", COMPRESSORS, ids=str)
def test_version_2_has_the_samples_of_zarr_python(tmp_path, compressor):
    rng = np.random.default_rng(5)
    for number, (name, order, separator) in enumerate(itertools.product(TYPES, "CF", "./")):
        dtype = np.dtype(name)
        shape, chunks = rng.integers(2, 9, 3), rng.integers(1, 6, 3)
        samples = random_samples(rng, shape, dtype)
        folder = tmp_path / str(number)
        array = zarr.open_array(
            str(folder),
            mode="w",
            shape=tuple(shape),
            chunks=tuple(chunks),
            dtype=dtype,
            order=order,
            compressor=compressor,
            dimension_separator=separator,
            fill_value=7,
            write_empty_chunks=bool(number % 2),
        )
        array[:] = samples
        array[: shape[0] // 2] = 7  # chunks of the fill value have no file
        volume = marrow.read(folder, spacing=(1, 2, 3))
        assert np.array_equal(volume.array, array[:]), (name, order, separator)
        in_memory = {"u4": "f8", "i8": "f8", "u8": "f8"}.get(name[1:], name[1:])
        assert volume.dtype == np.dtype("=" + in_memory)


def test_fill_values(tmp_path):
    for dtype, value in (("<f4", float("nan")), ("<f8", float("-inf")), ("<i2", -5), ("|b1", True)):
        folder = tmp_path / f"{dtype[1:]}{value}"
        array = zarr.open_array(str(folder), mode="w", shape=(4, 4, 4), chunks=(2, 2, 2), dtype=dtype, fill_value=value)
        array[0, 0, 0] = 1
        expected = np.nan_to_num(array[:].astype(float), nan=-77)
        assert np.array_equal(np.nan_to_num(marrow.read(folder, spacing=(1, 1, 1)).array.astype(float), nan=-77), expected)


def test_fill_values_of_integers_may_be_written_as_floats(tmp_path):
    zarr.open_array(str(tmp_path / "a"), mode="w", shape=(2, 2, 2), chunks=(2, 2, 2), dtype="<i2")
    metadata = json.loads((tmp_path / "a" / ".zarray").read_text())
    for value, taken in ((0.0, True), (-5.0, True), (0.5, False), (40000.0, False), (1e300, False)):
        (tmp_path / "a" / ".zarray").write_text(json.dumps({**metadata, "fill_value": value}))
        if taken:
            assert (marrow.read(tmp_path / "a", spacing=(1, 1, 1)).array == value).all()
        else:
            with pytest.raises(marrow.InputError, match="fill_value"):
                marrow.read(tmp_path / "a", spacing=(1, 1, 1))


def encode(chunk, order, endian, compressor, checksum):
    data = np.ascontiguousarray(chunk.transpose(order)).astype(chunk.dtype.newbyteorder(endian)).tobytes()
    if compressor:
        data = bytes(compressor.encode(data))
    return data + crc32c(data) if checksum else data


def write_version_3(folder, samples, chunks, *, shards=None, order=(0, 1, 2), endian="<", compressor=None,
                    checksum=False, index_at_start=False, naming="default", separator=None, fill=0, skip=()):
    """Write an array of Zarr 3, with chunks number `skip` missing."""
    codecs = [{"name": "bytes", "configuration": {"endian": "little" if endian == "<" else "big"}}]
    if list(order) != [0, 1, 2]:
        codecs.insert(0, {"name": "transpose", "configuration": {"order": list(order)}})
    if compressor:
        codecs.append({"name": compressor.codec_id, "configuration": {}})
    if checksum:
        codecs.append({"name": "crc32c"})
    if shards:
        index_codecs = [{"name": "bytes", "configuration": {"endian": "little"}}, {"name": "crc32c"}]
        codecs = [{"name": "sharding_indexed", "configuration": {
            "chunk_shape": list(chunks), "codecs": codecs, "index_codecs": index_codecs,
            "index_location": "start" if index_at_start else "end"}}]
    keys = {"name": naming, **({"configuration": {"separator": separator}} if separator else {})}
    metadata = {"zarr_format": 3, "node_type": "array", "shape": list(samples.shape), "data_type": samples.dtype.name,
                "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": list(shards or chunks)}},
                "chunk_key_encoding": keys, "codecs": codecs, "fill_value": fill}
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "zarr.json").write_text(json.dumps(metadata))
    files = shards or chunks
    expected = samples.copy()
    fill_sample = 0 if isinstance(fill, str) else fill
    count = itertools.count()

    def chunk_at(begin):
        chunk = np.full(chunks, fill_sample, samples.dtype)
        part = tuple(slice(b, b + c) for b, c in zip(begin, chunks))
        there = samples[part]
        chunk[tuple(slice(0, n) for n in there.shape)] = there
        if next(count) in skip:
            expected[part] = fill_sample
            return None
        return encode(chunk, order, endian, compressor, checksum)

    between = separator or ("/" if naming == "default" else ".")
    for index in itertools.product(*(range(-(-n // f)) for n, f in zip(samples.shape, files))):
        begin = [i * f for i, f in zip(index, files)]
        if shards:
            inner = list(itertools.product(*(range(s // c) for s, c in zip(shards, chunks))))
            body, table, size = b"", b"", (16 * len(inner) + 4 if index_at_start else 0)
            for place in inner:
                start = [b + p * c for b, p, c in zip(begin, place, chunks)]
                data = chunk_at(start) if all(s < n for s, n in zip(start, samples.shape)) else None
                if data is None:
                    table += struct.pack("<QQ", 2**64 - 1, 2**64 - 1)
                else:
                    table += struct.pack("<QQ", size + len(body), len(data))
                    body += data
            table += crc32c(table)
            data = table + body if index_at_start else body + table
        else:
            data = chunk_at(begin)
        if data is None:
            continue
        name = (["c"] if naming == "default" else []) + [str(i) for i in index]
        path = folder / between.join(name)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    return expected


VERSION_3 = {
    "plain": {},
    "big endian": {"endian": ">"},
    "transposed": {"order": (2, 0, 1)},
    "blosc": {"compressor": numcodecs.Blosc()},
    "gzip and checksum": {"compressor": numcodecs.GZip(), "checksum": True},
    "zstd, transposed": {"compressor": numcodecs.Zstd(), "order": (1, 2, 0), "endian": ">"},
    "dots": {"separator": "."},
    "names of version 2": {"naming": "v2"},
    "missing": {"skip": (0, 3, 4), "fill": -3},
    "shards": {"shards": (4, 6, 8)},
    "shards, index first": {"shards": (4, 6, 8), "index_at_start": True, "compressor": numcodecs.Zstd()},
    "shards with gaps": {"shards": (4, 6, 8), "skip": (1, 2, 9), "checksum": True, "order": (2, 1, 0)},
}


@pytest.mark.parametrize("options", VERSION_3.values(), ids=VERSION_3)
def test_version_3(tmp_path, options):
    samples = random_samples(np.random.default_rng(6), (9, 7, 11), np.dtype("i2"))
    expected = write_version_3(tmp_path / "a", samples, (2, 3, 4), **options)
    assert np.array_equal(marrow.read(tmp_path / "a", spacing=(1, 1, 1)).array, expected)


def test_fill_values_of_version_3_may_be_bits(tmp_path):
    samples = np.ones((2, 2, 2), np.float32)
    write_version_3(tmp_path / "a", samples, (1, 2, 2), fill="0x40200000", skip=(1,))
    assert np.array_equal(marrow.read(tmp_path / "a", spacing=(1, 1, 1)).array[:, 0, 0], [1, 2.5])


def test_an_image_lies_where_its_metadata_say(tmp_path):
    samples = random_samples(np.random.default_rng(7), (6, 8, 10), np.dtype("u1"))
    steps = [{"type": "scale", "scale": [1, 1, 2]}, {"type": "translation", "translation": [1000, 2000, 3000]}]
    write_image(tmp_path / "a", [samples, samples[::2, ::2, ::2]], spacing=(300.0, 200.0, 100.0), coordinateTransformations=steps)
    volume = marrow.read(tmp_path / "a")
    assert np.array_equal(volume.array, samples)
    assert np.allclose(volume.spacing, [0.2, 0.2, 0.3]) and np.allclose(volume.origin, [3, 2, 1])
    assert volume.info.format == "Zarr" and volume.warnings == ()
    coarse = marrow.read(tmp_path / "a", level=1)
    assert np.array_equal(coarse.array, samples[::2, ::2, ::2]) and np.allclose(coarse.spacing, [0.4, 0.4, 0.6])
    report = marrow.inspect(tmp_path / "a")
    assert report.series[0].levels == ((6, 8, 10), (3, 4, 5)) and report.series[0].refusal is None
    with pytest.raises(marrow.InputError, match="level 2"):
        marrow.read(tmp_path / "a", level=2)
    with pytest.raises(marrow.InputError, match="spacing"):
        marrow.read(tmp_path / "a", spacing=(1, 1, 1))


def test_axes_in_another_order_keep_their_place(tmp_path):
    samples = random_samples(np.random.default_rng(8), (4, 5, 6), np.dtype("i2"))
    write_image(tmp_path / "a", [samples], names="xyz", spacing=(1000.0, 2000.0, 3000.0))
    volume = marrow.read(tmp_path / "a")
    assert np.allclose(volume.affine[:3, :3] @ [5, 4, 3], [3 * 1, 4 * 2, 5 * 3])


def change_image(folder, change):
    attributes = json.loads((folder / ".zattrs").read_text())
    change(attributes["multiscales"][0])
    (folder / ".zattrs").write_text(json.dumps(attributes))


def test_axes_may_state_where_they_run_in_the_body(tmp_path):
    samples = random_samples(np.random.default_rng(8), (4, 5, 6), np.dtype("i2"))

    def read(orientations):
        def orient(image):
            for axis, value in zip(image["axes"], orientations):
                axis["orientation"] = {"type": "anatomical", "value": value}

        steps = [{"type": "translation", "translation": [7000, 5000, 3000]}]
        write_image(tmp_path / "a", [samples], unit="micrometer", spacing=(1000.0,), coordinateTransformations=steps)
        change_image(tmp_path / "a", orient)
        return marrow.read(tmp_path / "a")

    volume = read(["inferior-to-superior", "posterior-to-anterior", "left-to-right"])
    assert np.allclose(volume.affine[:3, 3], [-3, -5, 7]) and volume.warnings == ()
    assert np.allclose(volume.affine[:3, :3], np.diag([-1, -1, 1]))
    sagittal = read(["right-to-left", "superior-to-inferior", "anterior-to-posterior"])
    assert np.allclose(sagittal.affine[:3] @ [1, 2, 3, 1], [7 + 3, 3 + 1, -5 - 2])
    for orientations in (["inferior-to-superior"], ["ventral-to-dorsal"] * 3, [None] * 3):
        volume = read(orientations)
        assert np.allclose(volume.affine[:3, :3], np.eye(3)) and "orientation" in volume.warnings[0]
    with pytest.raises(marrow.InputError, match="two axes"):
        read(["inferior-to-superior", "left-to-right", "left-to-right"])


def test_an_image_without_a_scale_needs_a_spacing(tmp_path):
    samples = random_samples(np.random.default_rng(8), (4, 5, 6), np.dtype("u1"))
    write_image(tmp_path / "a", [samples])
    change_image(tmp_path / "a", lambda image: image["datasets"][0].pop("coordinateTransformations"))
    with pytest.raises(marrow.GeometryError, match="spacing"):
        marrow.read(tmp_path / "a")
    volume = marrow.read(tmp_path / "a", spacing=(1, 2, 3))
    assert np.array_equal(volume.spacing, [1, 2, 3]) and volume.warnings == ()


def test_several_volumes_need_a_choice(tmp_path):
    samples = random_samples(np.random.default_rng(9), (2, 3, 4, 5, 6), np.dtype("u2"))
    omero = {"channels": [{"label": "DAPI"}, {"label": "GFP"}, {}]}
    write_image(tmp_path / "a", [samples], names="tczyx")
    attributes = json.loads((tmp_path / "a" / ".zattrs").read_text())
    (tmp_path / "a" / ".zattrs").write_text(json.dumps({**attributes, "omero": omero}))
    with pytest.raises(marrow.GeometryError, match="6 volumes"):
        marrow.read(tmp_path / "a")
    volumes = marrow.inspect(tmp_path / "a").series[0].volumes
    assert volumes[4] == "time 1, channel 1 (GFP)"
    for number in range(6):
        assert np.array_equal(marrow.read(tmp_path / "a", volume=number).array, samples[number // 3, number % 3])
    with pytest.raises(marrow.InputError, match="no volume 6"):
        marrow.read(tmp_path / "a", volume=6)


def test_version_0_5(tmp_path):
    samples = random_samples(np.random.default_rng(10), (5, 6, 7), np.dtype("i2"))
    write_version_3(tmp_path / "a" / "full", samples, (2, 2, 4), shards=(4, 4, 4))
    image = {"axes": axes("zyx", "millimeter"), "datasets": [{"path": "full", "coordinateTransformations": scale(3, 2, 1)}]}
    group = {"zarr_format": 3, "node_type": "group", "attributes": {"ome": {"version": "0.5", "multiscales": [image]}}}
    (tmp_path / "a" / "zarr.json").write_text(json.dumps(group))
    volume = marrow.read(tmp_path / "a")
    assert np.array_equal(volume.array, samples) and np.array_equal(volume.spacing, [1, 2, 3])
    assert np.array_equal(marrow.read(tmp_path / "a" / "zarr.json").array, samples)


def test_a_spacing_that_a_folder_does_not_state_is_given_for_files(ball, tmp_path):
    folder = tmp_path / "plain"
    zarr.save_array(str(folder), ball, chunks=(7, 8, 9))
    marrow.extract(marrow.read(folder, spacing=(1, 2, 3)), 300.5).write(tmp_path / "whole.ply")
    marrow.extract_to_file(folder, 300.5, tmp_path / "parts.ply", spacing=(1, 2, 3))
    assert (tmp_path / "parts.ply").read_bytes() == (tmp_path / "whole.ply").read_bytes()
    with pytest.raises(marrow.InputError, match="do not give others"):
        marrow.extract_to_file(folder, 300.5, tmp_path / "parts.ply", spacing=2, origin=(1, 2, 3))
    write_image(tmp_path / "image", [ball], unit="millimeter")
    with pytest.raises(marrow.InputError, match="states its spacing"):
        marrow.extract_to_file(tmp_path / "image", 300.5, tmp_path / "parts.ply", spacing=2)


def test_numbers_without_units_are_millimetres_with_a_warning(tmp_path):
    samples = random_samples(np.random.default_rng(11), (4, 4, 4), np.dtype("u1"))
    write_image(tmp_path / "a", [samples], unit=None, spacing=(3.0, 2.0, 1.0))
    volume = marrow.read(tmp_path / "a")
    assert np.array_equal(volume.spacing, [1, 2, 3]) and "unit" in volume.warnings[0]
    volume = marrow.read(tmp_path / "a", spacing=(4, 5, 6))
    assert np.array_equal(volume.spacing, [4, 5, 6]) and volume.warnings == ()


@pytest.mark.parametrize("dtype", ["i2", "u4"])
def test_a_surface_that_is_written_slice_by_slice_has_the_same_bytes(ball, tmp_path, dtype):
    samples = (ball - ball.min()).astype(dtype)
    level = 300.5 - float(ball.min())
    for number, chunks in enumerate([(7, 8, 9), (1, 31, 32), (30, 4, 4), (64, 64, 64)]):
        array = zarr.open_array(str(tmp_path / f"{number}"), mode="w", shape=ball.shape, chunks=chunks, dtype=dtype)
        array[:] = samples
        folder = tmp_path / f"{number}.image"
        write_image(folder, [samples], unit="millimeter")
        marrow.extract(marrow.read(folder), level).write(tmp_path / "whole.ply")
        for source in (folder, array):
            marrow.extract_to_file(source, level, tmp_path / "parts.ply", max_memory="4M")
            assert (tmp_path / "parts.ply").read_bytes() == (tmp_path / "whole.ply").read_bytes()


def test_slices_are_asked_for_in_whole_chunks(ball, tmp_path):
    array = zarr.open_array(str(tmp_path / "a"), mode="w", shape=ball.shape, chunks=(8, 31, 32), dtype=ball.dtype)
    array[:] = ball
    asked = []

    class Recorder:
        shape, dtype, chunks = array.shape, array.dtype, array.chunks

        def __getitem__(self, key):
            asked.append((key.start, key.stop))
            return array[key]

    marrow.extract_to_file(Recorder(), 300.5, tmp_path / "a.stl", max_memory="60K")
    assert asked == [(0, 8), (8, 16), (16, 24), (24, 30)] * 2


def damaged_metadata():
    def change(*path, to):
        def apply(metadata):
            inner = metadata
            for key in path[:-1]:
                inner = inner[key]
            if to is KeyError:
                del inner[path[-1]]
            else:
                inner[path[-1]] = to
        return apply

    image = ("multiscales", 0)
    first = (*image, "datasets", 0)
    return {
        "no axes": (".zattrs", change(*image, "axes", to=KeyError), "'axes' is missing"),
        "axes are a number": (".zattrs", change(*image, "axes", to=3), "not an array"),
        "axes of an old version": (".zattrs", change(*image, "version", to="0.1"), "0.1"),
        "two axes": (".zattrs", change(*image, "axes", to=axes("yx")), "two axes"),
        "four in space": (".zattrs", change(*image, "axes", to=axes("xzyx")), "last three"),
        "the same twice": (".zattrs", change(*image, "axes", to=axes("zxx")), "two axes"),
        "time last": (".zattrs", change(*image, "axes", to=axes("zyxt")), "last three"),
        "another unit": (".zattrs", change(*image, "axes", to=axes("zyx", "furlong")), "furlong"),
        "no levels": (".zattrs", change(*image, "datasets", to=[]), "empty"),
        "too many levels": (".zattrs", change(*image, "datasets", to=[{"path": "0"}] * 100), "100 levels"),
        "no array": (".zattrs", change(*first, "path", to="7"), "missing"),
        "a path above": (".zattrs", change(*first, "path", to="../../b"), "folder"),
        "an absolute path": (".zattrs", change(*first, "path", to="/etc"), "folder"),
        "a scale of 0": (".zattrs", change(*first, "coordinateTransformations", to=scale(0, 1, 1)), "positive"),
        "a scale too few": (".zattrs", change(*first, "coordinateTransformations", to=scale(1, 1)), "2 numbers"),
        "a rotation": (".zattrs", change(*first, "coordinateTransformations", to=[{"type": "rotation"}]), "rotation"),
        "no size": ("0/.zarray", change("shape", to=KeyError), "shape"),
        "a size of 0": ("0/.zarray", change("shape", to=[4, 0, 4]), "shape"),
        "a negative size": ("0/.zarray", change("shape", to=[4, -1, 4]), "shape"),
        "a fraction": ("0/.zarray", change("shape", to=[4, 1.5, 4]), "shape"),
        "one axis more": ("0/.zarray", change("shape", to=[4, 4, 4, 4]), "axes"),
        "huge": ("0/.zarray", change("shape", to=[2**50, 2**50, 2**50]), ""),
        "larger than memory": ("0/.zarray", change("shape", to=[2**20, 2**15, 2**15]), "memory"),
        "chunks of 0": ("0/.zarray", change("chunks", to=[0, 1, 1]), "chunks"),
        "huge chunks": ("0/.zarray", change("chunks", to=[2**20, 2**20, 2**20]), "2 GiB"),
        "objects": ("0/.zarray", change("dtype", to="|O"), "not supported"),
        "half floats": ("0/.zarray", change("dtype", to="<f2"), "not supported"),
        "structures": ("0/.zarray", change("dtype", to=[["a", "<i2"]]), "string"),
        "filters": ("0/.zarray", change("filters", to=[{"id": "delta"}]), "delta"),
        "another codec": ("0/.zarray", change("compressor", to={"id": "bz2"}), "bz2"),
        "a fill value of another type": ("0/.zarray", change("fill_value", to="x"), "fill_value"),
        "a fill value out of range": ("0/.zarray", change("fill_value", to=70000), "fill_value"),
        "another separator": ("0/.zarray", change("dimension_separator", to="../"), "separator"),
    }


DAMAGES = damaged_metadata()


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES)
def test_damaged_metadata_are_refused(tmp_path, damage):
    name, apply, message = damage
    write_image(tmp_path / "a", [np.zeros((4, 4, 4), np.int16)])
    metadata = json.loads((tmp_path / "a" / name).read_text())
    apply(metadata)
    (tmp_path / "a" / name).write_text(json.dumps(metadata))
    with pytest.raises((marrow.InputError, marrow.LimitError), match=message):
        marrow.read(tmp_path / "a")


@pytest.mark.parametrize("text", ["", "{", "[]", "{}", "null", '{"multiscales": 1}', "[" * 100000])
def test_metadata_that_are_none_are_refused(tmp_path, text):
    write_image(tmp_path / "a", [np.zeros((4, 4, 4), np.int16)])
    (tmp_path / "a" / ".zattrs").write_text(text)
    with pytest.raises(marrow.InputError):
        marrow.read(tmp_path / "a")


@pytest.mark.parametrize("compressor", COMPRESSORS[:6], ids=str)
def test_damaged_chunks_are_refused(tmp_path, compressor):
    rng = np.random.default_rng(12)
    array = zarr.open_array(str(tmp_path / "a"), mode="w", shape=(8, 8, 8), chunks=(8, 8, 8), dtype="i2", compressor=compressor)
    array[:] = random_samples(rng, (8, 8, 8), np.dtype("i2"))
    chunk = tmp_path / "a" / "0.0.0"
    whole = chunk.read_bytes()
    for size in (0, 1, 3, 16, len(whole) // 2, len(whole) - 1):
        chunk.write_bytes(whole[:size])
        with pytest.raises(marrow.InputError, match="0.0.0"):
            marrow.read(tmp_path / "a", spacing=(1, 1, 1))
    for _ in range(200):  # damage that no checksum covers may go unnoticed, but does no harm
        damaged = bytearray(whole)
        damaged[rng.integers(len(whole))] ^= 1 << int(rng.integers(8))
        chunk.write_bytes(damaged)
        try:
            assert marrow.read(tmp_path / "a", spacing=(1, 1, 1)).shape == (8, 8, 8)
        except marrow.InputError:
            pass


@pytest.mark.parametrize("compressor", COMPRESSORS[1:], ids=str)
def test_chunks_of_one_value_are_read_however_small(tmp_path, compressor):
    # What a chunk may claim is limited by what its compressor can reach, which zeros do.
    array = zarr.open_array(
        str(tmp_path / "a"), mode="w", shape=(128, 256, 256), chunks=(128, 256, 256), dtype="u1", compressor=compressor,
        fill_value=1, write_empty_chunks=True,
    )
    array[:] = 0
    volume = marrow.read(tmp_path / "a", spacing=(1, 1, 1))
    assert volume.shape == (128, 256, 256) and not volume.array.any()


def test_damaged_shards_are_refused(tmp_path):
    samples = random_samples(np.random.default_rng(13), (4, 4, 4), np.dtype("i2"))
    write_version_3(tmp_path / "a", samples, (2, 2, 2), shards=(4, 4, 4), checksum=True)
    shard = tmp_path / "a" / "c" / "0" / "0" / "0"
    whole = shard.read_bytes()
    for place in range(len(whole)):
        damaged = bytearray(whole)
        damaged[place] ^= 4
        shard.write_bytes(damaged)
        with pytest.raises(marrow.InputError, match="chunk"):  # every byte is under a checksum
            marrow.read(tmp_path / "a", spacing=(1, 1, 1))
    for size in (0, 100, len(whole) - 1):
        shard.write_bytes(whole[:size])
        with pytest.raises(marrow.InputError, match="chunk"):
            marrow.read(tmp_path / "a", spacing=(1, 1, 1))


def test_groups_name_the_images_in_them(tmp_path):
    zarr.open_group(str(tmp_path / "a"), mode="w")
    with pytest.raises(marrow.InputError, match="no image"):
        marrow.read(tmp_path / "a")
    write_image(tmp_path / "a" / "0", [np.zeros((4, 4, 4), np.int16)])
    with pytest.raises(marrow.InputError, match="in it: .*0"):
        marrow.read(tmp_path / "a")


def test_reading_can_be_cancelled(tmp_path):
    zarr.open_array(str(tmp_path / "a"), mode="w", shape=(256, 256, 256), chunks=(4, 4, 4), dtype="u1")
    seen = []

    def progress(fraction):
        seen.append(fraction)
        return fraction < 0.2

    with pytest.raises(marrow.Cancelled):
        marrow.read(tmp_path / "a", spacing=(1, 1, 1), progress=progress)
    assert seen == sorted(seen) and 0.2 <= seen[-1] < 1
