"""How notebooks show volumes and meshes."""

from __future__ import annotations

import base64
import html
import struct
import zlib
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from ._mesh import Mesh
    from ._volume import Volume

_PIXELS = 160  # of the longer side of a picture


def volume_html(volume: Volume) -> str:
    """Return a table, and the middle slice."""
    nz, ny, nx = volume.shape
    rows = {
        "samples": f"{nx} x {ny} x {nz}, {volume._sample_text()}",
        "spacing": " x ".join(f"{value:g}" for value in volume.spacing) + " mm",
        "origin": ", ".join(f"{value:g}" for value in volume.origin) + " mm (LPS)",
    }
    if volume.info:
        rows["read from"] = " ".join((volume.info.format, volume.info.series.modality))
    for number, warning in enumerate(volume.warnings, 1):
        rows[f"warning {number}"] = warning
    picture = _grey(volume[nz // 2 : nz // 2 + 1, :, :].array[0]) if volume.samples.size else None
    return _html("marrow.Volume", rows, picture)


def mesh_html(mesh: Mesh) -> str:
    """Return a table."""
    rows = {"points": f"{len(mesh.points):,}", "triangles": f"{len(mesh.triangles):,}"}
    if len(mesh.points):
        size = mesh.points.max(axis=0) - mesh.points.min(axis=0)
        rows["size"] = " x ".join(f"{value:.4g}" for value in size) + " mm"
    if mesh.name:
        rows["name"] = mesh.name
    return _html("marrow.Mesh", rows, None)


def _html(title: str, rows: dict[str, str], picture: Any) -> str:
    cells = "".join(f"<tr><th>{html.escape(key)}</th><td>{html.escape(text)}</td></tr>" for key, text in rows.items())
    image = "" if picture is None else f'<img alt="" src="data:image/png;base64,{_png(picture)}">'
    return f"<div><b>{title}</b><table>{cells}</table>{image}</div>"


def _grey(section: NDArray[Any]) -> NDArray[np.uint8]:
    step = -(-max(section.shape) // _PIXELS)
    values = section[::step, ::step].astype(float)
    values[~np.isfinite(values)] = np.nan
    if np.isnan(values).all():
        return np.zeros(values.shape, np.uint8)
    low, high = np.nanpercentile(values, (1, 99))
    grey: NDArray[np.uint8] = (
        255 * np.clip((np.nan_to_num(values, nan=low) - low) / ((high - low) or 1), 0, 1)
    ).astype(np.uint8)
    return grey


def _png(pixels: NDArray[np.uint8]) -> str:
    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    height, width = pixels.shape
    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    rows = b"".join(b"\0" + row.tobytes() for row in pixels)
    png = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")
    return base64.b64encode(png).decode()
