"""A surface becomes a mesh to print: only the largest part, smooth, with fewer triangles, and checked.

usage: print_ready.py SCAN ISOVALUE MESH
"""

import sys

import marrow


def main(scan_path: str, isovalue: float, mesh_path: str) -> None:
    scan = marrow.read(scan_path)
    surface = marrow.extract(scan, isovalue, closed=True, snap=0.3)
    surface = surface.keep_components(1, cavities=False).smooth(bound=scan.affine)
    reduced = surface.simplify(max_error=0.1)
    distance = reduced.distance(surface)
    check = reduced.check()
    reduced.write(mesh_path, verify=True)
    print(
        f"{len(surface.triangles)} triangles became {len(reduced.triangles)}, at most {distance.max:.2f} mm away; "
        f"closed: {check.is_closed}, manifold: {check.is_manifold}"
    )


if len(sys.argv) != 4:
    sys.exit(__doc__)
main(sys.argv[1], float(sys.argv[2]), sys.argv[3])
