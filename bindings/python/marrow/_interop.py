"""Meshes for other packages. Each is imported only when it is asked for."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from ._mesh import Mesh


def to_vtk(mesh: Mesh) -> Any:
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData

    points = vtkPoints()
    points.SetData(numpy_to_vtk(mesh.points))
    cells = vtkCellArray()
    # VTK's cells know no uint32.
    triangles = mesh.triangles if mesh.triangles.dtype == np.int32 else mesh.triangles.astype(np.int64)
    cells.SetData(3, numpy_to_vtk(triangles.reshape(-1)))
    # SetData leaves its argument, and makes another array of the same memory.
    cells.GetConnectivityArray()._numpy_reference = triangles
    surface = vtkPolyData()
    surface.SetPoints(points)
    surface.SetPolys(cells)
    if mesh.normals is not None:
        normals = numpy_to_vtk(mesh.normals)
        normals.SetName("Normals")
        surface.GetPointData().SetNormals(normals)
    return surface


def to_pyvista(mesh: Mesh) -> Any:
    import pyvista

    return pyvista.wrap(to_vtk(mesh))


def to_trimesh(mesh: Mesh) -> Any:
    import trimesh

    # Without process=False, trimesh would merge and reorder points.
    return trimesh.Trimesh(mesh.points, mesh.triangles, vertex_normals=mesh.normals, process=False)


def to_meshio(mesh: Mesh) -> Any:
    import meshio

    data = {} if mesh.normals is None else {"Normals": mesh.normals}
    return meshio.Mesh(mesh.points, [("triangle", mesh.triangles)], point_data=data)


def to_open3d(mesh: Mesh) -> Any:
    import open3d

    surface = open3d.geometry.TriangleMesh(
        open3d.utility.Vector3dVector(mesh.points.astype(np.float64)), open3d.utility.Vector3iVector(mesh.triangles)
    )
    if mesh.normals is not None:
        surface.vertex_normals = open3d.utility.Vector3dVector(mesh.normals.astype(np.float64))
    return surface
