"""Names and colours of labels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Optional, Union

from . import _marrow
from ._marrow import InputError
from ._volume import Volume

if TYPE_CHECKING:
    from ._scan import Path

Colour = tuple[float, float, float]


@dataclass(frozen=True)
class LabelEntry:
    """The name and the colour of a label.

    Attributes
    ----------
    name : str
        Empty: the mesh gets the segment's name, or ``label-N``.
    colour : tuple of 3 floats, optional
        Red, green, blue from 0 to 1. None: the mesh gets the segment's, or a colour that depends on the label.
    """

    name: str
    colour: Optional[Colour] = None


def read_label_table(path: Path) -> dict[int, LabelEntry]:
    """Read names and colours of labels: text as of 3D Slicer, FreeSurfer or ITK-SNAP, or "label name" a line.

    Raises
    ------
    IoError
        The file cannot be read.
    InputError
        A line has another form, or a label occurs twice.
    """
    return label_table(_marrow.read_label_table(path))


def label_table(entries: Mapping[int, tuple[Any, ...]]) -> dict[int, LabelEntry]:
    """Return the table that C++ gives as tuples."""
    return {label: LabelEntry(*entry) for label, entry in entries.items()}


def entries_of(table: Union[Path, Mapping[int, LabelEntry], None], volume: Any) -> dict[int, LabelEntry]:
    """Return the entries of a table, and what they leave out as in `volume` if that is a segmentation.

    Files are read: call it before long work.
    """
    own = volume.info.series.labels if isinstance(volume, Volume) and volume.info else {}
    merged = dict(own)
    for label, entry in _read(table).items():
        before = own.get(label, LabelEntry(""))
        colour = before.colour if entry.colour is None else entry.colour  # which may be an array
        merged[label] = LabelEntry(entry.name or before.name, colour)
    return merged


def _read(table: Union[Path, Mapping[int, LabelEntry], None]) -> Mapping[int, LabelEntry]:
    if not isinstance(table, Mapping):
        return read_label_table(table) if table is not None else {}
    for label, entry in table.items():
        if not isinstance(entry, LabelEntry):
            raise InputError(f"the table has {entry!r} for label {label}: give a LabelEntry, with a name and a colour")
    return table
