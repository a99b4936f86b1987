"""Surfaces of arrays that are larger than one machine, on any Dask cluster.

>>> import marrow.dask
>>> from dask.distributed import Client
>>> client = Client("scheduler:8786")
>>> marrow.dask.extract_to_file("/shared/scan.ome.zarr", 1200, "/shared/surface.ply")

The array is cut into blocks. Each task reads its own block from the store, and results have the same bytes as those of
one machine, for any blocks and any number of workers. A task that is lost with its worker is done again and changes
nothing. Tasks are named marrow-count, marrow-write and so on: Dask's dashboard and `distributed.progress` show them.
"""

from __future__ import annotations

import itertools
import json
import math
import operator
import os
import uuid
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path as FilePath
from typing import Any, NoReturn, Optional

import distributed
import numpy as np
from dask.base import is_dask_collection
from numpy.typing import ArrayLike

from . import _marrow
from ._arrays import Array, as_array, as_samples, sample_dtype
from ._marrow import EmptySurface, InputError
from ._mesh import FileSpace, Mesh
from ._scan import Path
from ._streaming import SurfaceSize
from ._volume import Geometry, Spacing

__all__ = ["extract", "extract_to_file", "write_fragments"]

# The samples of a block take at most about so many bytes, unless the caller chooses the blocks: for tasks that have all of
# them in memory, and for tasks that read some slices at a time.
BLOCK_BYTES = 2**27
STREAMED_BLOCK_BYTES = 2**29
# Tasks read at least so many slices at a time.
LEAST_SLICES = 16


def extract(
    array: Any,
    isovalue: float,
    *,
    closed: bool = False,
    normals: bool = True,
    spacing: Optional[Spacing] = None,
    origin: Optional[ArrayLike] = None,
    direction: Optional[ArrayLike] = None,
    affine: Optional[ArrayLike] = None,
    blocks: Optional[Sequence[int]] = None,
    client: Optional[distributed.Client] = None,
) -> Mesh:
    """Extract a surface whose parts are merged in the memory of this process.

    Parameters
    ----------
    array : path-like or array-like, shape (nz, ny, nx)
        A folder of OME-Zarr or Zarr that all workers can reach; an array of Zarr, which tasks read from its store; a
        Dask array; a NumPy array; or another object with ``shape``, ``dtype`` and slices that can be sent to workers.
    isovalue : float
        In the unit of the samples.
    closed, normals
        As for `marrow.extract`.
    spacing, origin, direction, affine
        As for `marrow.Volume`. A folder states its own.
    blocks : sequence of 3 ints, optional
        The most samples (nz, ny, nx) of a block, which are rounded up to whole chunks where the array has them.
        By default blocks of at most about 128 MiB.
    client : distributed.Client, optional
        By default the current one.

    Returns
    -------
    Mesh
        The surface, with the bytes of `marrow.extract` of the whole array.

    Raises
    ------
    EmptySurface
        All samples are on one side of the isovalue.
    InputError
        The array cannot be sliced or has not three axes, the folder is not Zarr or has to be given a geometry, or
        there is no client.
    LimitError
        More than 2^32 - 1 points, or not enough memory.
    """
    source = _Source(array, spacing=spacing, origin=origin, direction=direction, affine=affine)
    with _Tasks(client) as tasks:
        parts = [
            tasks.submit(
                "extract",
                _extract,
                tasks.samples(source, block),
                block,
                source.geometry,
                isovalue,
                closed,
                normals,
            )
            for layer in source.layers(blocks, whole_rows=False)
            for block in layer
        ]
        mesh = Mesh._of(_marrow.merge_parts(tasks.gather(parts)))
    if len(mesh.triangles) == 0:
        _raise_empty(isovalue)
    return mesh


def extract_to_file(
    array: Any,
    isovalue: float,
    path: Path,
    *,
    closed: bool = False,
    space: FileSpace = "LPS",
    spacing: Optional[Spacing] = None,
    origin: Optional[ArrayLike] = None,
    direction: Optional[ArrayLike] = None,
    affine: Optional[ArrayLike] = None,
    blocks: Optional[Sequence[int]] = None,
    client: Optional[distributed.Client] = None,
) -> SurfaceSize:
    """Extract a surface of any size to a file, which all workers write at the same time.

    The array is read twice: tasks first count the points and triangles of their blocks, so that each block knows its
    place in the file, and then write them. Neither this process nor any worker holds more than a few blocks.

    Parameters
    ----------
    array, isovalue, closed, spacing, origin, direction, affine, client
        As for `extract`.
    path : path-like
        The output, .stl or .ply, in a folder that all workers can write to. It appears when it is complete.
    space : {'LPS', 'RAS', 'none'}
        The space of the file's coordinates, as for `marrow.Mesh.write`.
    blocks : sequence of 3 ints, optional
        As for `extract`. By default they have whole rows, because blocks that are cut along the last axis are written in
        many small pieces, and at most about 512 MiB, of which a task has some slices in memory at a time.

    Returns
    -------
    SurfaceSize
        The numbers of points and triangles. The file has the bytes of ``marrow.extract(...).write(path)``, apart from
        normals that point against their faces, in thin walls: only the latter turns them.

    Raises
    ------
    EmptySurface, InputError, LimitError
        As `extract`; InputError also for a format that cannot be written in parts.
    IoError
        A worker cannot write the file. The old file stays.
    """
    source = _Source(array, spacing=spacing, origin=origin, direction=direction, affine=affine)
    path = os.path.abspath(path)
    with _Tasks(client) as tasks:
        layers = list(source.layers(blocks, whole_rows=True))
        counts = [
            [
                tasks.submit("count", _count, tasks.samples(source, block), block, source.geometry, isovalue, closed)
                for block in layer
            ]
            for layer in layers
        ]
        # Only sizes come to this process. The counts stay with the workers.
        sizes = [tasks.gather([tasks.submit("size", _size, part) for part in layer]) for layer in counts]
        size = _total(itertools.chain.from_iterable(sizes))
        if size.triangles == 0:
            _raise_empty(isovalue)
        file = _marrow.FileOfParts(path, size.points, size.triangles, normals=True, space=space)
        try:
            _write_blocks(tasks, source, isovalue, closed, layers, counts, sizes, file.description)
            file.commit()
        finally:
            file.discard()
    return size


def _write_blocks(
    tasks: _Tasks,
    source: _Source,
    isovalue: float,
    closed: bool,
    layers: list[list[_Block]],
    counts: list[list[distributed.Future]],
    sizes: list[list[SurfaceSize]],
    file: Any,
) -> None:
    """Number the blocks layer by layer, and write those that have a part of the surface."""
    written = []
    before = SurfaceSize(0, 0)
    for number, layer in enumerate(layers):
        following = counts[number + 1] if number + 1 < len(layers) else []
        slices = [tasks.submit("slice", _first_slice, part) for part in following]
        numbers = tasks.submit("number", _number, counts[number], slices, before)
        for index, (block, size) in enumerate(zip(layer, sizes[number])):
            if size == SurfaceSize(0, 0):
                continue
            samples = tasks.samples(source, block)
            place = tasks.submit("place", operator.getitem, numbers, index)
            written.append(
                tasks.submit("write", _write, samples, block, source.geometry, isovalue, closed, place, file)
            )
        before = _total([before, *sizes[number]])
    tasks.gather(written)


def write_fragments(
    array: Any,
    isovalue: float,
    folder: Path,
    *,
    segment: int = 1,
    closed: bool = False,
    spacing: Optional[Spacing] = None,
    origin: Optional[ArrayLike] = None,
    direction: Optional[ArrayLike] = None,
    affine: Optional[ArrayLike] = None,
    blocks: Optional[Sequence[int]] = None,
    client: Optional[distributed.Client] = None,
) -> SurfaceSize:
    """Extract a surface of any size as fragments for Neuroglancer, one for each block, in its legacy mesh format.

    Neighbouring fragments repeat the points on their common border with the same coordinates, so that there is no seam.
    Nothing limits the size of the whole surface.

    Parameters
    ----------
    array, isovalue, closed, spacing, origin, direction, affine, blocks, client
        As for `extract`.
    folder : path-like
        A folder that all workers can write to, for example ``mesh`` in a folder of the Precomputed format. It gets ``info``,
        ``<segment>:0`` with the names of the fragments, and the fragments, with coordinates in nanometres.
    segment : int
        The number of the segment that the surface belongs to.

    Returns
    -------
    SurfaceSize
        The points and triangles of all fragments together.

    Raises
    ------
    EmptySurface, InputError, LimitError
        As `extract`.
    OSError
        A worker cannot write to the folder.
    """
    source = _Source(array, spacing=spacing, origin=origin, direction=direction, affine=affine)
    target = FilePath(folder).absolute()
    target.mkdir(parents=True, exist_ok=True)
    with _Tasks(client) as tasks:
        all_blocks = list(itertools.chain.from_iterable(source.layers(blocks, whole_rows=False)))
        names = [f"{segment}-{'-'.join(map(str, block.first))}" for block in all_blocks]
        sizes = tasks.gather(
            [
                tasks.submit(
                    "fragment",
                    _write_fragment,
                    tasks.samples(source, block),
                    block,
                    source.geometry,
                    isovalue,
                    closed,
                    target / name,
                )
                for block, name in zip(all_blocks, names)
            ]
        )
    size = _total(sizes)
    if size.triangles == 0:
        _raise_empty(isovalue)
    fragments = [name for name, part in zip(names, sizes) if part.triangles]
    _replace(target / "info", json.dumps({"@type": "neuroglancer_legacy_mesh"}).encode())
    _replace(target / f"{segment}:0", json.dumps({"fragments": fragments}).encode())
    return size


@dataclass(frozen=True)
class _Block:
    """A part of the array: indices along (x, y, z)."""

    whole: tuple[int, ...]  #: samples of the whole array
    first: tuple[int, ...]  #: the first sample of the block
    dims: tuple[int, ...]  #: its samples; it shares the last ones with the next blocks
    slices_at_once: int = 1  #: slices that are read together, because they are stored together

    def with_halo(self) -> tuple[tuple[int, ...], tuple[slice, ...]]:
        """Return the first sample to read, and the slices to read, with a sample more on each side for normals."""
        begin = [max(first - 1, 0) for first in self.first]
        end = [min(f + n + 1, whole) for f, n, whole in zip(self.first, self.dims, self.whole)]
        return tuple(begin), tuple(slice(b, e) for b, e in zip(reversed(begin), reversed(end)))

    def steps(self) -> list[_Block]:
        """Cut the block across z, so that each step needs some slices more that are stored together.

        A step ends two samples before these slices do, because it shares one with the next step and normals need one more.
        """
        begin, last = self.first[2], self.first[2] + self.dims[2] - 1
        at_once = self.slices_at_once
        end = min(last + 2, self.whole[2])  # of the slices to read
        ends = range((begin // at_once + 1) * at_once, end, at_once)
        cuts = [begin, *(z - 2 for z in ends if z - 2 > begin), last]
        return [
            replace(self, first=(*self.first[:2], z), dims=(*self.dims[:2], following - z + 1))
            for z, following in zip(cuts, cuts[1:])
        ]


class _Image:
    """A folder of Zarr, which Marrow reads by itself."""

    def __init__(self, path: Path) -> None:
        self.path = os.path.abspath(path)
        reader = self.open()
        self.shape, self.dtype, self.chunks = reader.shape, reader.dtype, reader.chunks

    def open(self) -> _marrow.BoxReader:
        return _marrow.BoxReader(self.path)


class _Source:
    """An array and how it is cut into blocks."""

    def __init__(self, array: Any, **geometry: Any) -> None:
        if isinstance(array, (str, os.PathLike)):
            if any(value is not None for value in geometry.values()):
                raise InputError("a folder states its own spacing, origin and direction: do not give others")
            self.array: Any = _Image(array)
            reader = self.array.open()
            geometry = {"spacing": reader.spacing, "origin": reader.origin, "direction": reader.direction}
        elif all(hasattr(array, name) for name in ("shape", "dtype", "__getitem__")):
            self.array = array
        else:
            raise InputError(f"a {type(array).__qualname__} has no shape, dtype and slices: give a path or an array")
        self.geometry = Geometry(self.array.shape, **geometry)
        sample_dtype(np.dtype(self.array.dtype))

    @property
    def is_in_store(self) -> bool:
        """Whether tasks read the array by themselves."""
        return not isinstance(self.array, np.ndarray) and not is_dask_collection(self.array)

    def layers(self, blocks: Optional[Sequence[int]], *, whole_rows: bool) -> Iterator[list[_Block]]:
        """Return the blocks between two cuts across z, from the lowest z."""
        shape = self.array.shape
        chunks = [_chunk(self.array, axis) for axis in range(3)]
        if blocks is None:
            streamed = whole_rows and self.is_in_store
            size = (STREAMED_BLOCK_BYTES if streamed else BLOCK_BYTES) // np.dtype(self.array.dtype).itemsize
            blocks = _default_blocks(shape, chunks, size, whole_rows)
        if len(blocks) != 3 or min(blocks) < 1:
            raise InputError(f"blocks are three sizes of at least one sample, not {blocks!r}")
        at_once = -(-LEAST_SLICES // chunks[0]) * chunks[0]
        nz, ny, nx = (_ranges(n, block, chunk) for n, block, chunk in zip(shape, blocks, chunks))
        for z in nz:
            yield [
                _Block(tuple(reversed(shape)), (x[0], y[0], z[0]), (x[1] - x[0], y[1] - y[0], z[1] - z[0]), at_once)
                for y in ny
                for x in nx
            ]


def _chunk(array: Any, axis: int) -> int:
    """Return the samples that are stored together along an axis: Dask's chunks may differ in size."""
    chunks = getattr(array, "chunks", None)
    if not chunks:
        return 1
    return int(chunks[axis] if isinstance(chunks[axis], (int, np.integer)) else chunks[axis][0])


def _default_blocks(shape: Sequence[int], chunks: Sequence[int], size: int, whole_rows: bool) -> list[int]:
    """Return blocks of whole chunks with at most `size` samples, about as many along each axis that is cut."""
    blocks = [min(n, chunk) for n, chunk in zip(shape, chunks)]
    axes = [0, 1] if whole_rows else [0, 1, 2]
    if whole_rows:
        blocks[2] = shape[2]
    while True:
        axes = [axis for axis in axes if blocks[axis] < shape[axis]]
        if not axes:
            return blocks
        axis = min(axes, key=lambda a: blocks[a])
        larger = [*blocks]
        larger[axis] = min(blocks[axis] + max(chunks[axis], LEAST_SLICES), shape[axis])
        if math.prod(larger) > size:
            return blocks
        blocks = larger


def _ranges(samples: int, block: int, chunk: int) -> list[tuple[int, int]]:
    """Return the first sample of each block along an axis, and the one after its last; the blocks are about equal.

    Blocks share a sample. Cuts are one sample after the begin of a chunk, so that the sample more that gradients need lies
    in the same chunk, and only the few samples at the end of a block are in a chunk that the next block reads too.
    """
    chunks = -(-samples // chunk)
    count = -(-chunks // -(-block // chunk))
    cuts = [chunks * i // count * chunk + (chunk > 1) for i in range(1, count)]
    cuts = [0, *(cut for cut in cuts if 0 < cut < samples - 1), samples - 1]
    return [(begin, end + 1) for begin, end in zip(cuts, cuts[1:])]


class _Tasks:
    """The tasks of one call. Those that are left when it ends are cancelled."""

    def __init__(self, client: Optional[distributed.Client]) -> None:
        try:
            self.client = client or distributed.default_client()
        except ValueError:
            raise InputError("there is no Dask client: create a dask.distributed.Client first") from None
        self.call = uuid.uuid4().hex
        self.futures: list[distributed.Future] = []

    def __enter__(self) -> _Tasks:
        return self

    def __exit__(self, *error: object) -> None:
        self.client.cancel([future for future in self.futures if not future.done()])

    def submit(self, name: str, function: Any, *arguments: Any) -> distributed.Future:
        key = f"marrow-{name}-{self.call}-{len(self.futures)}"
        future: distributed.Future = self.client.submit(function, *arguments, key=key)
        self.futures.append(future)
        return future

    def samples(self, source: _Source, block: _Block) -> Any:
        """Return what a task takes to get the samples of a block: an array that it reads, or the samples themselves."""
        if source.is_in_store:
            return source.array
        _, slices = block.with_halo()
        samples = source.array[slices]
        return self.client.compute(samples) if is_dask_collection(samples) else samples

    def gather(self, futures: list[distributed.Future]) -> list[Any]:
        return list(self.client.gather(futures))


def _part(samples: Any, block: _Block, geometry: Geometry) -> _marrow.ArrayPart:
    """Return the whole block."""
    return next(_parts(samples, [block], geometry))


def _parts(samples: Any, steps: list[_Block], geometry: Geometry) -> Iterator[_marrow.ArrayPart]:
    """Return the parts of a block one after the other. Each is valid until the next."""
    if isinstance(samples, np.ndarray):
        samples = np.require(as_samples(samples), requirements=["C", "ALIGNED"])  # after a message it may be neither
        z = steps[0].with_halo()[0][2]
        for step in steps:
            first, slices = step.with_halo()
            yield _array_part(samples[slices[0].start - z : slices[0].stop - z], first, step, geometry)
        return

    reader = samples.open() if isinstance(samples, _Image) else None
    regions = [step.with_halo() for step in steps]
    most_slices = max(z.stop - z.start for _, (z, _, _) in regions)
    _, y, x = regions[0][1]
    shape = (most_slices, y.stop - y.start, x.stop - x.start)
    buffer: Array = np.empty(shape, sample_dtype(np.dtype(samples.dtype)))
    held = range(0)  # the slices in the buffer
    for step, (first, (wanted, _, _)) in zip(steps, regions):
        kept = max(held.stop - wanted.start, 0)
        buffer[:kept] = buffer[len(held) - kept : len(held)]
        held = range(wanted.start, wanted.stop)
        missing = slice(wanted.start + kept, wanted.stop)
        out = buffer[kept : len(held)]
        if reader:
            reader.read((*first[:2], missing.start), out)
        else:
            read = as_samples(as_array(samples[missing, y, x]))
            if read.shape != out.shape:
                raise InputError(f"a block of the array has the shape {read.shape} instead of {out.shape}")
            np.copyto(out, read)
        yield _array_part(buffer[: len(held)], first, step, geometry)


def _array_part(array: Array, first: tuple[int, ...], block: _Block, geometry: Geometry) -> _marrow.ArrayPart:
    return _marrow.ArrayPart(
        array, first, block.first, block.dims, block.whole, geometry.spacing, geometry.origin, geometry.direction
    )


# The tasks. Each works on one thread: the workers of a cluster have as many at a time as they have threads.


def _extract(samples: Any, block: _Block, geometry: Geometry, isovalue: float, closed: bool, normals: bool) -> Any:
    part = _part(samples, block, geometry)
    return _marrow.extract_part(part, isovalue, closed=closed, normals=normals, threads=1)


def _count(samples: Any, block: _Block, geometry: Geometry, isovalue: float, closed: bool) -> list[Any]:
    """Return the counts of the steps of a block."""
    parts = _parts(samples, block.steps(), geometry)
    return [_marrow.count_part(part, isovalue, closed=closed, threads=1) for part in parts]


def _size(counts: list[Any]) -> SurfaceSize:
    return _total(
        SurfaceSize(int(points.sum(dtype=np.uint64)), int(triangles.sum(dtype=np.uint64)))
        for _, points, triangles in counts
    )


def _first_slice(counts: list[Any]) -> Any:
    return _marrow.first_slice(counts[0])


def _number(counts: list[list[Any]], following: list[Any], before: SurfaceSize) -> list[list[Any]]:
    """Return the numbers of the steps of all blocks between two cuts."""
    steps = list(itertools.chain.from_iterable(counts))
    numbers = iter(_marrow.number_parts(steps, following, before.points, before.triangles))
    return [list(itertools.islice(numbers, len(block))) for block in counts]


def _write(
    samples: Any, block: _Block, geometry: Geometry, isovalue: float, closed: bool, numbers: list[Any], file: Any
) -> None:
    for part, places in zip(_parts(samples, block.steps(), geometry), numbers):
        _marrow.extract_to_shared_file(part, places, isovalue, file, closed=closed, threads=1)


def _write_fragment(
    samples: Any, block: _Block, geometry: Geometry, isovalue: float, closed: bool, path: FilePath
) -> SurfaceSize:
    part = _part(samples, block, geometry)
    _, points, triangles, _, _ = _marrow.extract_part(part, isovalue, closed=closed, normals=False, threads=1)
    if len(triangles):
        nanometres = (points.astype(float) * 1e6).astype("<f4")
        count = np.array([len(points)], "<u4")
        _replace(path, count.tobytes() + nanometres.tobytes() + triangles.astype("<u4").tobytes())
    return SurfaceSize(len(points), len(triangles))


def _replace(path: FilePath, content: bytes) -> None:
    """Write a file that appears when it is complete, also if a task is done twice at the same time."""
    temporary = path.with_name(f".{path.name}.{uuid.uuid4().hex}")
    try:
        temporary.write_bytes(content)
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def _total(sizes: Any) -> SurfaceSize:
    points, triangles = 0, 0
    for size in sizes:
        points += size.points
        triangles += size.triangles
    return SurfaceSize(points, triangles)


def _raise_empty(isovalue: float) -> NoReturn:
    raise EmptySurface(f"no surface at isovalue {isovalue:g}: all samples are on one side of it")
