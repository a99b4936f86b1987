"""Compares surfaces of the same samples whose axes lie in another order in memory."""

import numpy as np


def is_same_surface(a, b):
    """Whether two meshes have the same points in some order, the same topology, and the same side outside.

    The order of the axes decides how the polygons of a cell are cut into triangles, so that areas and volumes may differ.
    """
    if len(a.points) != len(b.points) or len(a.triangles) != len(b.triangles):
        return False
    # The nearest point of the other mesh is the same point: different ones are further apart.
    near = [np.abs(b.points - point).max(axis=1).min() for point in a.points]
    sizes = [(m.components, m.boundary_edges, m.nonmanifold_edges) for m in (a.measure(), b.measure())]
    return max(near, default=0) < 1e-4 and sizes[0] == sizes[1] and is_same_side(a, b)


def is_same_side(a, b):
    """Whether both surfaces face the same way: by their volume if they are closed, and else by their border.

    The sum of all normals times area is an integral over the border (Stokes), so it does not depend on the triangles.
    """
    if a.measure().boundary_edges == 0:
        return a.measure().volume > 0 and b.measure().volume > 0
    return np.allclose(vector_area(a), vector_area(b), atol=1e-3)


def vector_area(mesh):
    corner = mesh.points.astype(float)[mesh.triangles]
    return np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]).sum(axis=0) / 2
