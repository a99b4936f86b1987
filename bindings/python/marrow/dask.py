"""Surfaces of arrays that are larger than one machine, on any Dask cluster.

>>> import marrow.dask
>>> from dask.distributed import Client
>>> client = Client("scheduler:8786")
>>> marrow.dask.extract_to_file("/shared/scan.ome.zarr", 1200, "/shared/surface.ply")

The array is cut into blocks. Each task reads its own block from the store, and results have the same bytes as those of
one machine for the array in C order, for any blocks and any number of workers. A task that is lost with its worker is
done again and changes nothing. Tasks are named marrow-count, marrow-write and so on: Dask's dashboard and
`distributed.progress` show them.
"""

from __future__ import annotations

import itertools
import json
import operator
import os
import uuid
from collections.abc import Mapping, Sequence
from pathlib import Path as FilePath
from typing import Any, NamedTuple, NoReturn, Optional, Union

import distributed
import numpy as np
from dask.base import is_dask_collection
from numpy.typing import ArrayLike

from . import _marrow
from ._arrays import as_number
from ._blocks import Block, KnownChunks, Source, block_sizes, chunks_of, label_part_of, part_of, parts_of, read_labels
from ._isosurface import check_for_cells
from ._label_table import LabelEntry, entries_of
from ._labels import named, renumbered
from ._marrow import EmptySurface, InputError
from ._mesh import FileSpace, Mesh
from ._scan import Path
from ._streaming import SurfaceSize
from ._volume import Geometry, Spacing

_LEGACY_MESH = "neuroglancer_legacy_mesh"

__all__ = ["extract", "extract_to_file", "labels", "write_fragments"]


def extract(
    array: Any,
    isovalue: float,
    *,
    closed: bool = False,
    normals: bool = True,
    topology: bool = False,
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
        Images as for `marrow.extract_to_file`.
    isovalue : float
        In the unit of the values.
    closed, normals, topology
        As for `marrow.extract`.
    spacing, origin, direction, affine
        As for `marrow.Volume`. An image has its own. So has a folder, but for `spacing` if it does not state it.
    blocks : sequence of 3 ints, optional
        The most samples (nz, ny, nx) of a block, which are rounded up to whole chunks where the array has them.
        By default blocks of at most about 128 MiB.
    client : distributed.Client, optional
        By default the current one.

    Returns
    -------
    Mesh
        The surface, with the bytes of `marrow.extract` of the whole array in C order.

    Raises
    ------
    EmptySurface
        All samples are on one side of the isovalue, or an open surface has a single sample along an axis.
    InputError
        The array cannot be sliced, or has not three axes or slices of its dtype; the folder is not Zarr or needs
        `spacing`; or there is no client.
    LimitError
        More than 2^32 - 1 points, or not enough memory.
    """
    isovalue = as_number(isovalue, "the isovalue")
    source = Source(array, spacing=spacing, origin=origin, direction=direction, affine=affine)
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
                topology,
            )
            for layer in source.layers(blocks, whole_rows=False)
            for block in layer
        ]
        mesh = Mesh._of(_marrow.merge_parts(tasks.gather(parts)))
    if len(mesh.triangles) == 0:
        _raise_empty(source, isovalue, closed)
    return mesh


def extract_to_file(
    array: Any,
    isovalue: float,
    path: Path,
    *,
    closed: bool = False,
    topology: bool = False,
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
    place in the file, and then write them. Of a folder, the second reading leaves out the chunks that the surface does
    not depend on. Neither this process nor any worker holds more than a few blocks.

    Parameters
    ----------
    array, isovalue, closed, topology, spacing, origin, direction, affine, client
        As for `extract`.
    path : path-like
        The output, .stl or .ply, in a folder that all workers can write to. It appears when it is complete.
    space : {'LPS', 'RAS', 'none'}
        The space of the file's coordinates, as for `marrow.Mesh.write`.
    blocks : sequence of 3 ints, optional
        As for `extract`. By default they have whole rows, because blocks that are cut along the last axis are written
        in many small pieces. A task has some slices of its block in memory at a time, about 64 MiB; there are some
        blocks for each thread of the workers, of at most about 1 GiB.

    Returns
    -------
    SurfaceSize
        The numbers of points and triangles. The file has the bytes of ``marrow.extract(...).write(path)`` for an
        array in C order.

    Raises
    ------
    EmptySurface, InputError, LimitError
        As `extract`; InputError also for a format that cannot be written in parts.
    IoError
        A worker cannot write the file. The old file stays.
    """
    isovalue = as_number(isovalue, "the isovalue")
    source = Source(array, spacing=spacing, origin=origin, direction=direction, affine=affine)
    path = os.path.abspath(path)
    _marrow.FileOfParts(path, 0, 0, normals=True, space=space).discard()  # refuses what cannot be written
    with _Tasks(client) as tasks:
        layers = list(source.layers(blocks, whole_rows=True, threads=tasks.threads()))
        counts = [
            [
                tasks.submit(
                    "count",
                    _count,
                    tasks.samples(source, block),
                    block,
                    source.geometry,
                    isovalue,
                    closed,
                    topology,
                )
                for block in layer
            ]
            for layer in layers
        ]
        # Only sizes come to this process. The counts stay with the workers.
        sizes = [tasks.gather([tasks.submit("size", _size, part) for part in layer]) for layer in counts]
        size = _total(itertools.chain.from_iterable(sizes))
        if size.triangles == 0:
            _raise_empty(source, isovalue, closed)
        file = _marrow.FileOfParts(path, size.points, size.triangles, normals=True, space=space)
        try:
            _write_blocks(tasks, source, isovalue, closed, topology, layers, counts, sizes, file.description)
            file.commit()
        finally:
            file.discard()
    return size


def _write_blocks(
    tasks: _Tasks,
    source: Source,
    isovalue: float,
    closed: bool,
    topology: bool,
    layers: list[list[Block]],
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
                tasks.submit("write", _write, samples, block, source.geometry, isovalue, closed, topology, place, file)
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
    topology: bool = False,
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
    array, isovalue, closed, topology, spacing, origin, direction, affine, blocks, client
        As for `extract`.
    folder : path-like
        A folder that all workers can write to, for example ``mesh`` in a folder of the Precomputed format. It gets
        ``info`` if it has none, ``<segment>:0`` with the names of the fragments, and the fragments, with coordinates in
        nanometres.
    segment : int
        The number of the segment that the surface belongs to, from 0 to 2^64 - 1.

    Returns
    -------
    SurfaceSize
        The points and triangles of all fragments together.

    Raises
    ------
    EmptySurface, InputError, LimitError
        As `extract`; InputError also for a folder whose ``info`` is not that of meshes.
    OSError
        A worker cannot write to the folder.
    """
    if not hasattr(segment, "__index__") or not 0 <= operator.index(segment) < 2**64:
        raise InputError(f"segment is a number from 0 to 2^64 - 1, not {segment!r}")
    segment = int(segment)  # which True is not
    isovalue = as_number(isovalue, "the isovalue")
    source = Source(array, spacing=spacing, origin=origin, direction=direction, affine=affine)
    target = FilePath(folder).absolute()
    has_info = _is_of_meshes(target / "info")
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
                    topology,
                    target / name,
                )
                for block, name in zip(all_blocks, names)
            ]
        )
    size = _total(sizes)
    if size.triangles == 0:
        _raise_empty(source, isovalue, closed)
    fragments = [name for name, part in zip(names, sizes) if part.triangles]
    if not has_info:
        _replace(target / "info", json.dumps({"@type": _LEGACY_MESH}).encode())
    _replace(target / f"{segment}:0", json.dumps({"fragments": fragments}).encode())
    return size


def labels(
    array: Any,
    *,
    background: int = 0,
    relax: int = 40,
    normals: bool = True,
    table: Union[Path, Mapping[int, LabelEntry], None] = None,
    spacing: Optional[Spacing] = None,
    origin: Optional[ArrayLike] = None,
    direction: Optional[ArrayLike] = None,
    affine: Optional[ArrayLike] = None,
    blocks: Optional[Sequence[int]] = None,
    client: Optional[distributed.Client] = None,
) -> dict[int, Mesh]:
    """Extract one closed surface for each label of a label map.

    Tasks extract and relax the surfaces of their blocks. This process merges them in its memory, keeps them from
    passing through each other, and computes normals.

    Parameters
    ----------
    array, spacing, origin, direction, affine, client
        As for `extract`. Labels beyond 2^53 are taken from arrays, but not from folders.
    background, relax, normals, table
        As for `marrow.labels`.
    blocks : sequence of 3 ints, optional
        As for `extract`, but blocks always have whole rows along the last axis. Tasks read `relax` + 2 samples more on
        all other sides, so that small blocks cost much.

    Returns
    -------
    dict of int to Mesh
        The surfaces by label, with the bytes of `marrow.labels` of the whole array in C order.

    Raises
    ------
    InputError
        As `extract`; samples are not integers, or a block has more than 65535 labels besides the background.
    LimitError
        As `extract`.
    """
    source = Source(array, spacing=spacing, origin=origin, direction=direction, affine=affine)
    halo = _marrow.label_part_halo(relax)
    entries = entries_of(table, array)
    if blocks is not None:
        blocks = [*block_sizes(blocks)[:2], source.array.shape[2]]
    with _Tasks(client) as tasks:
        all_blocks = [
            block.without_shared_samples(halo)
            for layer in source.layers(blocks, whole_rows=True)
            for block in layer
        ]
        parts = tasks.gather(
            [
                tasks.submit(
                    "labels", _labels, tasks.samples(source, block), block, source.geometry, background, relax
                )
                for block in all_blocks
            ]
        )
    # C++ merges them by the indices of labels, which may be too large for it.
    values = sorted({label for _, surfaces in parts for label, *_ in surfaces})
    number_of = {label: number for number, label in enumerate(values)}
    numbered = [
        (*part, [(number_of[label], *arrays) for label, *arrays in surfaces]) for part, surfaces in parts
    ]
    merged = _marrow.merge_label_parts(numbered, normals=normals)
    return named({values[number]: arrays for number, arrays in merged.items()}, entries)


class _Tasks:
    """The tasks of one call. Those that are left when it ends are cancelled."""

    def __init__(self, client: Optional[distributed.Client]) -> None:
        try:
            self.client = client or distributed.default_client()
        except ValueError:
            raise InputError("there is no Dask client: create a dask.distributed.Client first") from None
        if not isinstance(self.client, distributed.Client):
            raise InputError(f"client is a dask.distributed.Client, not {client!r}")
        self.call = uuid.uuid4().hex
        self.futures: list[distributed.Future] = []

    def __enter__(self) -> _Tasks:
        return self

    def __exit__(self, *error: object) -> None:
        self.client.cancel([future for future in self.futures if not future.done()])

    def threads(self) -> int:
        """Return the threads of all workers, of which more may come."""
        threads: int = sum(self.client.nthreads().values())
        return max(threads, 1)

    def submit(self, name: str, function: Any, *arguments: Any) -> distributed.Future:
        key = f"marrow-{name}-{self.call}-{len(self.futures)}"
        future: distributed.Future = self.client.submit(function, *arguments, key=key)
        self.futures.append(future)
        return future

    def samples(self, source: Source, block: Block) -> Any:
        """Return what a task takes to get the samples of a block: an array that it reads, or the samples themselves."""
        if source.is_in_store:
            return source.array
        _, slices = block.with_halo()
        samples = source.array[slices]
        return self.client.compute(samples) if is_dask_collection(samples) else samples

    def gather(self, futures: list[distributed.Future]) -> list[Any]:
        return list(self.client.gather(futures))


# The tasks. Each works on one thread: the workers of a cluster have as many at a time as they have threads.


def _extract(
    samples: Any, block: Block, geometry: Geometry, isovalue: float, closed: bool, normals: bool, topology: bool
) -> Any:
    part = part_of(samples, block, geometry)
    return _marrow.extract_part(part, isovalue, closed=closed, normals=normals, topology=topology, threads=1)


class _Counted(NamedTuple):
    counts: list[Any]  #: of the steps of a block
    chunks: Optional[KnownChunks]  #: that writing need not read again


class _Numbered(NamedTuple):
    numbers: list[Any]  #: of the steps of a block
    chunks: Optional[KnownChunks]


def _count(
    samples: Any, block: Block, geometry: Geometry, isovalue: float, closed: bool, topology: bool
) -> _Counted:
    steps = block.steps()
    counted = _Counted([], chunks_of(samples, block))
    for step, part in zip(steps, parts_of(samples, steps, geometry)):
        counted.counts.append(_marrow.count_part(part, isovalue, closed=closed, topology=topology, threads=1))
        if counted.chunks:
            counted.chunks.add(part, step, isovalue, closed)
    return counted


def _size(block: _Counted) -> SurfaceSize:
    return _total(
        SurfaceSize(int(points.sum(dtype=np.uint64)), int(triangles.sum(dtype=np.uint64)))
        for _, points, triangles, _ in block.counts
    )


def _first_slice(block: _Counted) -> Any:
    return _marrow.first_slice(block.counts[0])


def _number(blocks: list[_Counted], following: list[Any], before: SurfaceSize) -> list[_Numbered]:
    """Number all blocks between two cuts."""
    steps = list(itertools.chain.from_iterable(block.counts for block in blocks))
    numbers = iter(_marrow.number_parts(steps, following, before.points, before.triangles))
    return [_Numbered(list(itertools.islice(numbers, len(block.counts))), block.chunks) for block in blocks]


def _write(
    samples: Any,
    block: Block,
    geometry: Geometry,
    isovalue: float,
    closed: bool,
    topology: bool,
    numbered: _Numbered,
    file: Any,
) -> None:
    parts = parts_of(samples, block.steps(), geometry, numbered.chunks)
    for part, places in zip(parts, numbered.numbers):
        _marrow.extract_to_shared_file(part, places, isovalue, file, closed=closed, topology=topology, threads=1)


def _write_fragment(
    samples: Any, block: Block, geometry: Geometry, isovalue: float, closed: bool, topology: bool, path: FilePath
) -> SurfaceSize:
    part = part_of(samples, block, geometry)
    _, points, triangles, *_ = _marrow.extract_part(
        part, isovalue, closed=closed, normals=False, topology=topology, threads=1
    )
    if len(triangles):
        nanometres = (points.astype(float) * 1e6).astype("<f4")
        count = np.array([len(points)], "<u4")
        _replace(path, count.tobytes() + nanometres.tobytes() + triangles.astype("<u4").tobytes())
    return SurfaceSize(len(points), len(triangles))


def _labels(samples: Any, block: Block, geometry: Geometry, background: int, relax: int) -> Any:
    """Return what a block is merged by, and its surfaces, of which each begins with the label."""
    values, numbers, number = renumbered(read_labels(samples, block), background)
    part = label_part_of(numbers, block, geometry)
    *rest, surfaces = _marrow.extract_label_part(part, background=number, relax=relax, threads=1)
    return rest, [(n if values is None else int(values[n]), *arrays) for n, *arrays in surfaces]


def _is_of_meshes(info: FilePath) -> bool:
    """Return whether a folder has an `info` already, which may not be that of anything but meshes."""
    try:
        stated = json.loads(info.read_bytes())
    except FileNotFoundError:
        return False
    except ValueError:
        stated = None
    if not isinstance(stated, dict) or stated.get("@type") != _LEGACY_MESH:
        raise InputError(f"'{info}' is not that of meshes: choose another folder, for example 'mesh' in this one")
    return True


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


def _raise_empty(source: Source, isovalue: float, closed: bool) -> NoReturn:
    if 0 in source.array.shape:
        raise EmptySurface("the array has no sample, so there is no surface")
    check_for_cells(source.array.shape, closed)
    raise EmptySurface(f"no surface at isovalue {isovalue:g}: all finite samples are on one side of it")
