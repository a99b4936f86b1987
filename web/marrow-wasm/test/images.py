"""Compresses slices for the tests: python3 images.py FOLDER COLUMNS ROWS < samples of uint8, slice by slice.

Writes to FOLDER, for slice 7, `007.j2k`, `007.png`, `007.jpg` and `007.tif`, the last with one compression after the other, and
the first slice as TIFF with compressions that browsers are not given: `lzma.tiff` and so on.
"""

import pathlib
import sys

from PIL import Image

folder, columns, rows = pathlib.Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
samples = sys.stdin.buffer.read()
area = columns * rows
for name in ["lzma", "zstd", "webp"]:
    mode = "RGB" if name == "webp" else "L"
    Image.frombytes("L", (columns, rows), samples[:area]).convert(mode).save(folder / f"{name}.tiff", compression=name)
for k in range(len(samples) // area):
    image = Image.frombytes("L", (columns, rows), samples[k * area : (k + 1) * area])
    name = str(folder / f"{k:03d}")
    image.save(name + ".png")
    image.save(name + ".jpg", quality=85)
    image.save(name + ".j2k", irreversible=False, no_jp2=True)
    compressions = [None, "tiff_lzw", "tiff_adobe_deflate", "packbits", "jpeg"]
    image.save(name + ".tif", compression=compressions[k % len(compressions)])
