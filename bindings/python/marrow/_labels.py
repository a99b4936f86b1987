"""Surfaces of label maps."""

from __future__ import annotations

import operator
from collections.abc import Mapping
from typing import Any, Optional, Union

import numpy as np

from . import _marrow
from ._arrays import Array
from ._as_volume import as_volume
from ._label_table import LabelEntry, entries_of
from ._marrow import InputError
from ._mesh import Mesh
from ._scan import Path, Progress


def labels(
    volume: Any,
    *,
    background: int = 0,
    relax: int = 40,
    normals: bool = True,
    table: Union[Path, Mapping[int, LabelEntry], None] = None,
    threads: int = 0,
    progress: Optional[Progress] = None,
) -> dict[int, Mesh]:
    """Extract one closed surface for each label of a label map, by surface nets.

    Neighbouring surfaces share the points on their common border. After Gibson 1998 and Schaefer, Ju and
    Warren 2007.

    Parameters
    ----------
    volume : Volume or object that `as_volume` takes
        The map: integers of any size, such as uint64 labels of electron microscopy.
    background : int
        The label that has no surface; it also surrounds the volume.
    relax : int
        Smoothing passes, which remove the steps between samples; 0: none.
    normals : bool
        Compute a unit normal for each point.
    table : path-like or mapping of labels to LabelEntry, optional
        Names and colours for the meshes. What it leaves out is as in a segmentation, ``info.series.labels``, or
        else as by default.
    threads : int
        Threads to use; 0: all.
    progress : callable, optional
        As for `read`.

    Returns
    -------
    dict of int to Mesh
        The surfaces by label, ascending. Each mesh has a name and a colour: those of the table or of the segment,
        or else ``label-N`` and a colour that depends on the label.

    Raises
    ------
    InputError
        Samples are not integers, there are more than 65535 labels besides the background, their type does not
        have `background`, or `relax` is negative.
    Cancelled
        `progress` returned False.
    """
    entries = entries_of(table, volume)
    volume = as_volume(volume)
    values, numbers, number = renumbered(volume.array, background)
    surfaces = _marrow.labels(
        volume._native(numbers),
        background=number,
        relax=relax,
        normals=normals,
        threads=threads,
        progress=progress,
    )
    by_label = {n if values is None else int(values[n]): arrays for n, arrays in surfaces.items()}
    return named(by_label, entries)


def named(surfaces: Mapping[int, Any], entries: Mapping[int, LabelEntry]) -> dict[int, Mesh]:
    """Return the meshes of labels, with names and colours of a table or else the default ones."""
    meshes = {}
    for label, arrays in surfaces.items():
        entry = entries.get(label, LabelEntry(""))
        mesh = meshes[label] = Mesh._of(arrays)
        mesh.name = entry.name or f"label-{label}"
        mesh.colour = entry.colour
        if mesh.colour is None:
            mesh.colour = _marrow.default_label_colour((label + 2**63) % 2**64 - 2**63)  # an int64
    return meshes


def count_labels(volume: Any, *, threads: int = 0, progress: Optional[Progress] = None) -> dict[int, int]:
    """Count the samples of each label of a label map, including the background.

    Parameters
    ----------
    volume : Volume or object that `as_volume` takes
        The label map.
    threads : int
        Threads to use; 0: all.
    progress : callable, optional
        Called with the fraction done, from 0 to 1; returning False cancels.

    Returns
    -------
    dict
        The number of samples of each label that occurs.

    Raises
    ------
    InputError
        Samples are not integers.
    Cancelled
        `progress` returned False.
    """
    volume = as_volume(volume)
    values, numbers, _ = renumbered(volume.array, most=2**31)  # the indices are int32
    counts = _marrow.count_labels(volume._native(numbers), threads=threads, progress=progress)
    return counts if values is None else {int(values[number]): count for number, count in counts.items()}


def renumbered(array: Array, background: int = 0, most: int = 65536) -> tuple[Optional[Array], Array, int]:
    """Return the labels of a map, ascending, and the map of their indices, of a type that the core takes.

    The background is one of these labels, and its index comes last. Maps of types that the core takes anyway are
    returned as they are, with None and the background itself. At most `most` labels include the background.
    """
    if not hasattr(background, "__index__"):
        raise InputError(f"the background label is an integer, not {background!r}")
    background = operator.index(background)
    kind, size = array.dtype.kind, array.dtype.itemsize
    if kind not in "ui" or size < 4 or (kind == "i" and size == 4):
        return None, array, background
    if array.size == 0:
        return None, array.astype(np.int32), background
    limits = np.iinfo(array.dtype)
    if not limits.min <= background <= limits.max:
        raise InputError(f"the background label {background} does not fit the type {array.dtype} of the label map")
    outside = np.array([background], array.dtype)
    values = np.unique(np.concatenate([outside, *(np.unique(part) for part in array)]))
    if len(values) > most:
        raise InputError(
            f"the map has {len(values) - 1} labels besides the background, more than {most - 1}; extract a part of it"
        )
    numbers = np.empty_like(array, np.int32, subok=False)  # in the same order in memory
    for part, to in zip(array, numbers):
        to[...] = np.searchsorted(values, part)
    return values, numbers, int(np.searchsorted(values, outside[0]))
