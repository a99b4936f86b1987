"""A surface of a volume that does not fit in memory: only some slices of it are in memory at a time.

usage: larger_than_memory.py ARRAY.npy ISOVALUE MESH

Anything with shape, dtype and [z0:z1] will do instead of numpy.memmap: an array of Zarr, h5py or Dask.
"""

import sys

import marrow
import numpy as np


def show(fraction: float) -> None:
    print(f"\r{100 * fraction:3.0f} %", end="", file=sys.stderr, flush=True)


def main(array_path: str, isovalue: float, mesh_path: str) -> None:
    array = np.load(array_path, mmap_mode="r")
    size = marrow.extract_to_file(
        array, isovalue, mesh_path, spacing=(0.5, 0.5, 1.0), closed=True, max_memory="1G", progress=show
    )
    print(f"wrote {size.points} points and {size.triangles} triangles to {mesh_path}")


if len(sys.argv) != 4:
    sys.exit(__doc__)
main(sys.argv[1], float(sys.argv[2]), sys.argv[3])
