"""A scan becomes a mesh.

usage: extract.py SCAN ISOVALUE MESH      (ISOVALUE: a number, otsu, or for CT bone, muscle, soft, fat or skin)
"""

import sys

import marrow


def main(scan_path: str, isovalue: str, mesh_path: str) -> None:
    scan = marrow.read(scan_path)
    is_name = isovalue == "otsu" or isovalue in marrow.TISSUE_PRESETS
    mesh = marrow.extract(scan, isovalue if is_name else float(isovalue), closed=True)
    mesh.write(mesh_path)
    print(f"{len(mesh.triangles)} triangles enclose {mesh.measure().volume / 1000:.1f} mL")


if len(sys.argv) != 4:
    sys.exit(__doc__)
main(*sys.argv[1:])
