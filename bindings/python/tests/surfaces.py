"""Compares surfaces of the same samples whose axes lie in another order in memory."""

import numpy as np


def is_same_surface(a, b):
    """Whether two meshes have the same points in some order, the same topology, and the same side outside.

    The order of the axes decides how the polygons of a cell are cut into triangles, so that areas and volumes may differ.
    """
    if len(a.points) != len(b.points) or len(a.triangles) != len(b.triangles):
        return False
    # The nearest point of the other mesh is the same point: different ones are further apart.
    parts = np.array_split(a.points, 1 + len(a.points) // 64)
    near = [np.abs(b.points[:, None] - part).max(axis=2).min(axis=0).max() for part in parts]
    measures = [mesh.measure(threads=1) for mesh in (a, b)]  # other threads take longer to start than to measure
    sizes = [(m.components, m.boundary_edges, m.nonmanifold_edges) for m in measures]
    return max(near) < 1e-4 and sizes[0] == sizes[1] and is_same_side(a, b, measures)


def is_same_side(a, b, measures):
    """Whether both surfaces face the same way: by their volume if they are closed, and else by their border.

    The sum of all normals times area is an integral over the border (Stokes), so it does not depend on the triangles.
    """
    if measures[0].boundary_edges == 0:
        return all(m.volume > 0 for m in measures)
    return np.allclose(vector_area(a), vector_area(b), atol=1e-3)


def vector_area(mesh):
    corner = mesh.points.astype(float)[mesh.triangles]
    return np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]).sum(axis=0) / 2
