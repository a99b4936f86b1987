"""How an array that is larger than memory is cut into blocks, and how a task reads its block."""

from __future__ import annotations

import math
import operator
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Optional

import numpy as np
from dask.base import is_dask_collection

from . import _marrow
from ._arrays import Array, as_array, as_samples, as_samples_of, sample_dtype
from ._as_volume import as_slices
from ._marrow import InputError
from ._scan import Path
from ._streaming import spacing_of_path
from ._volume import Geometry

# The samples of a block take at most about so many bytes, unless the caller chooses the blocks.
BLOCK_BYTES = 2**27
# Blocks of which a task has only some slices in memory at a time may be larger. These slices take at most about
# STEP_BYTES, so blocks are long along z. Larger blocks read fewer chunks twice, but each thread should have some of
# them, and a block is lost with its worker.
LEAST_STREAMED_BYTES = 2**29
MOST_STREAMED_BYTES = 2**30
BLOCKS_PER_THREAD = 4
STEP_BYTES = 2**26
# Tasks read at least so many slices at a time.
LEAST_SLICES = 16


@dataclass(frozen=True)
class Block:
    """A part of the array: indices along (x, y, z)."""

    whole: tuple[int, ...]  #: samples of the whole array
    first: tuple[int, ...]  #: the first sample of the block
    dims: tuple[int, ...]  #: its samples; it shares the last ones with the next blocks
    dtype: Any  #: that the array promises for its samples
    slices_at_once: int = 1  #: slices that are read together, because they are stored together
    halo: int = 1  #: samples around the block that a task reads too; one for normals

    def with_halo(self) -> tuple[tuple[int, ...], tuple[slice, ...]]:
        """Return the first sample to read, and the slices to read."""
        begin = [max(first - self.halo, 0) for first in self.first]
        end = [min(f + n + self.halo, whole) for f, n, whole in zip(self.first, self.dims, self.whole)]
        return tuple(begin), tuple(slice(b, e) for b, e in zip(reversed(begin), reversed(end)))

    def without_shared_samples(self, halo: int) -> Block:
        """Return the block without the samples that the next blocks have too, and with another halo."""
        own = [n if first + n == whole else n - 1 for first, n, whole in zip(self.first, self.dims, self.whole)]
        return replace(self, dims=tuple(own), halo=halo)

    def steps(self) -> list[Block]:
        """Cut the block across z, so that each step needs some slices more that are stored together.

        A step ends two samples before these slices do, because it shares one with the next step and normals need one
        more.
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


class KnownChunks:
    """The chunks of a block, and those of them that need not be read again.

    The surface does not depend on the values in these, so that one of their samples can stand for all.
    """

    def __init__(self, block: Block, chunk: Sequence[int], dtype: Any) -> None:
        self.chunk = tuple(chunk)
        _, slices = block.with_halo()
        self.first = [s.start // n for s, n in zip(slices, self.chunk)]
        shape = [-(-s.stop // n) - first for s, n, first in zip(slices, self.chunk, self.first)]
        self.are_known = np.ones(shape, np.uint8)
        self.samples: Array = np.zeros(shape, dtype)

    def add(self, part: _marrow.ArrayPart, step: Block, isovalue: float, closed: bool) -> None:
        """Take a step into account. A chunk is known if all steps that have some of it know it."""
        flags = _marrow.chunks_without_surface(part, self.chunk[::-1], isovalue, closed=closed, threads=1)
        _, slices = step.with_halo()
        at = self._overlapping(slices)
        self.are_known[at] &= flags.reshape(self.are_known[at].shape)
        begins = [
            np.maximum(np.arange(s.start // n, -(-s.stop // n)) * n - s.start, 0) for s, n in zip(slices, self.chunk)
        ]
        self.samples[at] = part.array[np.ix_(*begins)]

    def within(self, slices: Sequence[slice]) -> tuple[Array, Array]:
        """Return what BoxReader takes for a box of samples."""
        at = self._overlapping(slices)
        return np.ascontiguousarray(self.are_known[at]), np.ascontiguousarray(self.samples[at])

    def _overlapping(self, slices: Sequence[slice]) -> tuple[slice, ...]:
        return tuple(
            slice(s.start // n - first, -(-s.stop // n) - first)
            for s, n, first in zip(slices, self.chunk, self.first)
        )


class _Image:
    """A folder of Zarr, which Marrow reads by itself."""

    def __init__(self, path: Path, spacing: Any) -> None:
        self.path, self.spacing = os.path.abspath(path), spacing
        reader = self.open()
        self.shape, self.dtype, self.chunks = reader.shape, reader.dtype, reader.chunks

    def open(self) -> _marrow.BoxReader:
        return _marrow.BoxReader(self.path, spacing=self.spacing)


class Source:
    """An array and how it is cut into blocks."""

    def __init__(self, array: Any, **geometry: Any) -> None:
        if isinstance(array, (str, os.PathLike)):
            self.array: Any = _Image(array, spacing_of_path(**geometry))
            reader = self.array.open()
            self.geometry = Geometry(
                reader.shape, spacing=reader.spacing, origin=reader.origin, direction=reader.direction
            )
        else:
            self.array, self.geometry = as_slices(array, **geometry)
        sample_dtype(np.dtype(self.array.dtype))

    @property
    def is_in_store(self) -> bool:
        """Whether tasks read the array by themselves."""
        return not isinstance(self.array, np.ndarray) and not is_dask_collection(self.array)

    def layers(
        self, blocks: Optional[Sequence[int]], *, whole_rows: bool, threads: Optional[int] = None
    ) -> Iterator[list[Block]]:
        """Return the blocks between two cuts across z, from the lowest z.

        With `threads`, of all workers together, a task has some of a block's slices at a time.
        """
        shape = self.array.shape
        if 0 in shape:
            return
        chunks = [_chunk(self.array, axis) for axis in range(3)]
        at_once = -(-LEAST_SLICES // chunks[0]) * chunks[0]
        if blocks is None:
            itemsize = np.dtype(self.array.dtype).itemsize
            if threads and self.is_in_store:
                blocks = _streamed_blocks(shape, chunks, itemsize, at_once, threads)
            else:
                blocks = _default_blocks(shape, chunks, BLOCK_BYTES // itemsize, whole_rows)
        nz, ny, nx = (_ranges(n, block, chunk) for n, block, chunk in zip(shape, block_sizes(blocks), chunks))
        whole, dtype = tuple(reversed(shape)), np.dtype(self.array.dtype)
        for z in nz:
            yield [
                Block(whole, (x[0], y[0], z[0]), (x[1] - x[0], y[1] - y[0], z[1] - z[0]), dtype, at_once)
                for y in ny
                for x in nx
            ]


def block_sizes(blocks: Any) -> list[int]:
    """Return the most samples of a block along (z, y, x)."""
    try:
        sizes = [operator.index(size) for size in blocks]
    except TypeError:
        sizes = []
    if len(sizes) != 3 or min(sizes) < 1:
        raise InputError(f"blocks are three sizes of at least one sample, not {blocks!r}")
    return sizes


def _chunk(array: Any, axis: int) -> int:
    """Return the most samples stored together along an axis: Dask's chunks differ in size, and may be empty."""
    chunks = getattr(array, "chunks", None)
    return max(1, int(np.max(chunks[axis]))) if chunks else 1


def _default_blocks(
    shape: Sequence[int], chunks: Sequence[int], size: int, whole_rows: bool, most_rows: Optional[int] = None
) -> list[int]:
    """Return blocks of whole chunks with at most `size` samples, about as many along each axis that is cut.

    Beyond one chunk, they have at most `most_rows` along y.
    """
    blocks = [min(n, chunk) for n, chunk in zip(shape, chunks)]
    most = [shape[0], min(shape[1], most_rows or shape[1]), shape[2]]
    axes = [0, 1] if whole_rows else [0, 1, 2]
    if whole_rows:
        blocks[2] = shape[2]
    while True:
        larger = {axis: min(blocks[axis] + max(chunks[axis], LEAST_SLICES), shape[axis]) for axis in axes}
        axes = [axis for axis in axes if blocks[axis] < larger[axis] <= most[axis]]
        if not axes:
            return blocks
        axis = min(axes, key=lambda a: blocks[a])
        if math.prod(blocks) // blocks[axis] * larger[axis] > size:
            return blocks
        blocks[axis] = larger[axis]


def _streamed_blocks(
    shape: Sequence[int], chunks: Sequence[int], itemsize: int, at_once: int, threads: int
) -> list[int]:
    """Return blocks of whole rows, of which a task has `at_once` slices in memory."""
    share = math.prod(shape) * itemsize // (BLOCKS_PER_THREAD * threads)
    size = min(max(share, LEAST_STREAMED_BYTES), MOST_STREAMED_BYTES)
    most_rows = max(STEP_BYTES // (at_once * shape[2] * itemsize), 1)
    return _default_blocks(shape, chunks, size // itemsize, True, most_rows)


def _ranges(samples: int, block: int, chunk: int) -> list[tuple[int, int]]:
    """Return the first sample of each block along an axis, and the one after its last; the blocks are about equal.

    Blocks share a sample. Cuts are one sample after the begin of a chunk, so that the sample more that gradients need
    lies in the same chunk, and only the few samples at the end of a block are in a chunk that the next block reads too.
    """
    chunks = -(-samples // chunk)
    count = -(-chunks // -(-block // chunk))
    cuts = [chunks * i // count * chunk + (chunk > 1) for i in range(1, count)]
    cuts = [0, *(cut for cut in cuts if 0 < cut < samples - 1), samples - 1]
    return [(begin, end + 1) for begin, end in zip(cuts, cuts[1:])]


def part_of(samples: Any, block: Block, geometry: Geometry) -> _marrow.ArrayPart:
    """Return the whole block."""
    return next(parts_of(samples, [block], geometry))


def read_labels(samples: Any, block: Block) -> Array:
    """Return the samples of a block and of its halo, in their own type."""
    first, slices = block.with_halo()
    if isinstance(samples, np.ndarray):
        return as_array(samples)
    if isinstance(samples, _Image):
        reader = samples.open()
        read: Array = np.empty([s.stop - s.start for s in slices], reader.dtype)
        reader.read(first, read)
        return read
    return as_array(samples[slices])


def label_part_of(numbers: Array, block: Block, geometry: Geometry) -> _marrow.ArrayPart:
    """Return a part of the map whose samples, with the halo, are given in a type that the core takes."""
    numbers = np.require(as_samples(numbers), requirements=["C", "ALIGNED"])
    return _array_part(numbers, block.with_halo()[0], block, geometry)


def chunks_of(samples: Any, block: Block) -> Optional[KnownChunks]:
    """Return the chunks of a block, if they are read one by one."""
    return KnownChunks(block, samples.chunks, samples.dtype) if isinstance(samples, _Image) else None


def parts_of(
    samples: Any, steps: list[Block], geometry: Geometry, known: Optional[KnownChunks] = None
) -> Iterator[_marrow.ArrayPart]:
    """Return the parts of a block one after the other. Each is valid until the next.

    Chunks that are known are not read.
    """
    regions = [step.with_halo() for step in steps]
    begin, y, x = regions[0][1]
    rows = (y.stop - y.start, x.stop - x.start)
    dtype = sample_dtype(steps[0].dtype)
    if isinstance(samples, np.ndarray):
        shape = (regions[-1][1][0].stop - begin.start, *rows)
        samples = as_samples_of(samples, shape, dtype, "a block of the array")
        samples = np.require(samples, requirements=["C", "ALIGNED"])  # after a message it may be neither
        for step, (first, (z, _, _)) in zip(steps, regions):
            yield _array_part(samples[z.start - begin.start : z.stop - begin.start], first, step, geometry)
        return

    reader = samples.open() if isinstance(samples, _Image) else None
    buffer: Array = np.empty((max(z.stop - z.start for _, (z, _, _) in regions), *rows), dtype)
    held = range(0)  # the slices in the buffer
    for step, (first, (wanted, _, _)) in zip(steps, regions):
        kept = max(held.stop - wanted.start, 0)
        buffer[:kept] = buffer[len(held) - kept : len(held)]
        held = range(wanted.start, wanted.stop)
        missing = slice(wanted.start + kept, wanted.stop)
        out = buffer[kept : len(held)]
        if reader:
            reader.read((*first[:2], missing.start), out, known.within((missing, y, x)) if known else None)
        else:
            out[...] = as_samples_of(samples[missing, y, x], out.shape, out.dtype, "a block of the array")
        yield _array_part(buffer[: len(held)], first, step, geometry)


def _array_part(array: Array, first: tuple[int, ...], block: Block, geometry: Geometry) -> _marrow.ArrayPart:
    return _marrow.ArrayPart(
        array, first, block.first, block.dims, block.whole, geometry.spacing, geometry.origin, geometry.direction
    )
