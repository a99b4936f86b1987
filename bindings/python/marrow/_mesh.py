"""Triangle meshes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal, Optional

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _marrow
from ._arrays import Array, as_array, as_numbers
from ._label_table import Colour
from ._marrow import InputError, IoError
from ._measures import Distance, MeshCheck, MeshMeasures, Roughness, TriangleQuality
from ._scan import Path, Progress
from ._trust import Trust
from ._volume import _numbers

if TYPE_CHECKING:
    import meshio
    import open3d
    import pyvista
    import trimesh
    import vtk

FileSpace = Literal["LPS", "RAS", "none"]


class Mesh:
    """A triangle mesh whose triangles share their points.

    Parameters
    ----------
    points : array_like, shape (n, 3)
        The positions (x, y, z) of the points, in mm, LPS; float32.
    triangles : array_like, shape (m, 3)
        The indices of each triangle's points, counter-clockwise as seen from outside; int32.
    normals : array_like, shape (n, 3), optional
        One outward unit vector per point; float32.
    name : str
        Files that can hold names hold it.
    colour : sequence of 3 floats, optional
        Red, green, blue from 0 to 1, for files that can hold colours.

    Attributes
    ----------
    points, triangles, normals, name, colour
        As given. `normals` and `colour` may be None.
    trust : Trust or None
        How far each point can be trusted, if `extract` was asked for it. New meshes do not have it. Files that can
        hold it do: .ply and .vtp its numbers, .glb its colours.

    Raises
    ------
    InputError
        An array has another shape, no numbers or a mask, a triangle names a point that does not exist, `name` is no
        text, or a number of `colour` is not from 0 to 1.

    Notes
    -----
    Arrays of the given types in C order are used where they are; others are copied. The arrays of an extracted
    surface are the memory that Marrow wrote to, without a copy. They may be changed, and stay valid without the
    mesh, as do views of them. With more than 2^31 points, triangles are uint32.

    `smooth`, `simplify` and `keep_components` return new meshes with the same name and colour.
    """

    points: NDArray[np.float32]
    triangles: Array
    normals: Optional[NDArray[np.float32]]
    name: str
    colour: Optional[Colour]
    trust: Optional[Trust] = None

    def __init__(
        self,
        points: ArrayLike,
        triangles: ArrayLike,
        normals: Optional[ArrayLike] = None,
        *,
        name: str = "",
        colour: Optional[Sequence[float]] = None,
    ) -> None:
        self.points = _vectors("points", points)
        self.triangles = _indices(triangles, len(self.points))
        self.normals = None if normals is None else _vectors("normals", normals)
        self.name = _name(name)
        self.colour = _colour(colour)
        if self.normals is not None and len(self.normals) != len(self.points):
            raise InputError(f"there are {len(self.normals)} normals for {len(self.points)} points")

    @classmethod
    def _of(cls, arrays: tuple[Any, Any, Any], name: str = "", colour: Optional[Colour] = None) -> Mesh:
        """Return the mesh that C++ gives as its arrays."""
        mesh = cls.__new__(cls)
        mesh.points, mesh.triangles, mesh.normals = arrays
        mesh.name = name
        mesh.colour = colour
        return mesh

    def _surface(self) -> tuple[Any, ...]:
        """Return what files hold of the mesh."""
        arrays, colours = (self.trust._arrays(), self.trust.colours) if self.trust else ([], None)
        return self._native(), _name(self.name), _colour(self.colour), arrays, colours

    def _native(self) -> _marrow.ArrayMesh:
        return _marrow.ArrayMesh(self.points, self.triangles, self.normals)

    def __repr__(self) -> str:
        name = f" {self.name!r}" if self.name else ""
        return f"<marrow.Mesh{name}: {len(self.points)} points, {len(self.triangles)} triangles>"

    def _repr_html_(self) -> str:
        from ._html import mesh_html

        return mesh_html(self)

    def measure(self, *, threads: int = 0) -> MeshMeasures:
        """Measure size and topology.

        Parameters
        ----------
        threads : int
            Threads to use; 0: all.

        Raises
        ------
        InputError
            A triangle names a point that does not exist; so for all methods.
        """
        return MeshMeasures(**_marrow.measure(self._native(), threads=threads))

    def check(
        self, min_wall: Optional[float] = None, *, threads: int = 0, progress: Optional[Progress] = None
    ) -> MeshCheck:
        """Check whether the mesh is fit to be printed and measured.

        Parameters
        ----------
        min_wall : float, optional
            mm; find walls that are thinner.
        threads : int
            Threads to use; 0: all.
        progress : callable, optional
            As for `read`.

        Raises
        ------
        InputError
            A coordinate is not finite, or `min_wall` is negative or NaN.
        Cancelled
            `progress` returned False.
        """
        result = _marrow.check(self._native(), min_wall, threads=threads, progress=progress)
        return MeshCheck(measures=MeshMeasures(**result.pop("measures")), **result)

    def quality(self) -> TriangleQuality:
        """Measure the shape of the triangles."""
        return TriangleQuality(**_marrow.triangle_quality(self._native()))

    def mean_curvature(self, *, threads: int = 0, progress: Optional[Progress] = None) -> NDArray[np.float64]:
        """Return the mean curvature (k1 + k2) / 2 at each point in 1/mm, shape (n,).

        It is positive where the surface bulges outward, and NaN where the triangles of a point do not form one
        closed fan, as at the border. After Meyer, Desbrun, Schroeder and Barr 2003.
        """
        return _marrow.mean_curvature(self._native(), threads=threads, progress=progress)

    def roughness(self, window: float, *, threads: int = 0, progress: Optional[Progress] = None) -> Roughness:
        """Measure how much the mean curvature of points differs from its mean within `window` mm."""
        return Roughness(**_marrow.roughness(self._native(), window, threads=threads, progress=progress))

    def distance(
        self, other: Mesh, *, samples: int = 200_000, threads: int = 0, progress: Optional[Progress] = None
    ) -> Distance:
        """Measure the symmetric distance to another surface, in mm.

        Parameters
        ----------
        other : Mesh
            The other surface.
        samples : int
            Surface samples on each mesh, spread evenly over its area.
        threads : int
            Threads to use; 0: all.
        progress : callable, optional
            As for `read`.

        Raises
        ------
        InputError
            `other` is no Mesh, a mesh has no triangles, or `samples` is below 1.
        Cancelled
            `progress` returned False.
        """
        return Distance(
            *_marrow.distance(
                self._native(), as_mesh(other)._native(), samples=samples, threads=threads, progress=progress
            )
        )

    def keep_components(
        self, count: Optional[int] = None, *, min_volume: float = 0.0, cavities: bool = True, threads: int = 0
    ) -> Mesh:
        """Keep some of the connected components.

        Parameters
        ----------
        count : int, optional
            Keep those with the most triangles; cavities do not count, and go with the component around them.
        min_volume : float
            mm^3; drop closed components and cavities that enclose less.
        cavities : bool
            Keep cavities.
        threads : int
            Threads to use; 0: all.

        Raises
        ------
        InputError
            `count` is below 1, or `min_volume` is negative or NaN.
        """
        return self._changed(
            _marrow.keep_components(
                self._native(), count=count, min_volume=min_volume, cavities=cavities, threads=threads
            )
        )

    def smooth(
        self,
        iterations: int = 20,
        *,
        pass_band: float = 0.1,
        bound: Optional[ArrayLike] = None,
        max_move: Optional[float] = None,
        threads: int = 0,
        progress: Optional[Progress] = None,
    ) -> Mesh:
        """Remove noise and steps with a windowed sinc filter, which shrinks only thin parts (Taubin et al. 1996).

        Parameters
        ----------
        iterations : int
            The degree of the filter.
        pass_band : float
            Above 0, below 2; 0.1 keeps waves that are longer than about 10 edges.
        bound : array_like, shape (3, 3) or (4, 4), optional
            The volume's `affine`, or the linear part of it. No point then moves further than half a sample along
            each axis of the volume.
        max_move : float, optional
            mm; no point moves further.
        threads : int
            Threads to use; 0: all.
        progress : callable, optional
            As for `read`.

        Raises
        ------
        InputError
            An argument is out of range, or `bound` is singular.
        Cancelled
            `progress` returned False.
        """
        return self._changed(
            _marrow.smooth(
                self._native(),
                iterations=iterations,
                pass_band=pass_band,
                bound=None if bound is None else _linear_part(bound),
                max_move=max_move,
                threads=threads,
                progress=progress,
            )
        )

    def simplify(
        self,
        triangles: Optional[int] = None,
        *,
        max_error: Optional[float] = None,
        threads: int = 0,
        progress: Optional[Progress] = None,
    ) -> Mesh:
        """Reduce the number of triangles, by quadric errors (Garland and Heckbert 1997).

        Components and handles stay as they are, and so does the border. Where a limit cannot be reached with a
        valid mesh, the result has more triangles.

        Parameters
        ----------
        triangles : int, optional
            Stop at this many triangles.
        max_error : float, optional
            mm; the largest distance between the mesh and the result, which is measured.
        threads : int
            Threads to use; 0: all.
        progress : callable, optional
            As for `read`.

        Raises
        ------
        InputError
            `triangles` is negative, or `max_error` is not positive.
        Cancelled
            `progress` returned False.
        """
        return self._changed(
            _marrow.simplify(
                self._native(), triangles=triangles, max_error=max_error, threads=threads, progress=progress
            )
        )

    def write(
        self, path: Path, *, space: FileSpace = "LPS", verify: bool = False, progress: Optional[Progress] = None
    ) -> None:
        """Write the mesh to a file: .stl, .ply, .obj, each also with .gz, .vtp, .3mf, .glb or .dcm.

        The file appears complete or not at all, with the bytes that the command line writes. If the mesh has `trust`,
        .ply and .vtp hold `shift_mm`, `noise_mm` and `thin_wall` of each point, and .glb its colours.

        Parameters
        ----------
        path : path-like
            The extension selects the format. .dcm is an anonymous DICOM object (Encapsulated STL) with a frame of
            reference of its own; the command line states the one of the scan.
        space : {'LPS', 'RAS', 'none'}
            The space of the file's coordinates; RAS negates x and y. 'none': the mesh is not a patient's.
        verify : bool
            Read the file again and compare.
        progress : callable, optional
            As for `read`.

        Raises
        ------
        InputError
            The extension is unknown, a triangle names a point that does not exist, RAS for .glb or .dcm, or
            'none' for .dcm.
        IoError
            The file cannot be written, or with `verify` it differs from the mesh.
        LimitError
            The mesh is too large for the format.
        Cancelled
            `progress` returned False.
        """
        write_meshes([self], path, space=space, verify=verify, progress=progress)

    def to_vtk(self) -> vtk.vtkPolyData:
        """Return a vtkPolyData that shares the arrays."""
        from ._interop import to_vtk

        return to_vtk(self)

    def to_pyvista(self) -> pyvista.PolyData:
        """Return a pyvista.PolyData that shares the arrays."""
        from ._interop import to_pyvista

        return to_pyvista(self)

    def to_trimesh(self) -> trimesh.Trimesh:
        """Return a trimesh.Trimesh with the same points in the same order."""
        from ._interop import to_trimesh

        return to_trimesh(self)

    def to_meshio(self) -> meshio.Mesh:
        """Return a meshio.Mesh that shares the arrays."""
        from ._interop import to_meshio

        return to_meshio(self)

    def to_open3d(self) -> open3d.geometry.TriangleMesh:
        """Return an open3d.geometry.TriangleMesh, whose arrays are copies in float64."""
        from ._interop import to_open3d

        return to_open3d(self)

    def _changed(self, arrays: tuple[Any, Any, Any]) -> Mesh:
        return Mesh._of(arrays, self.name, self.colour)


def as_mesh(mesh: Any) -> Mesh:
    """Return a mesh as it is, and say what to do with anything else."""
    if not isinstance(mesh, Mesh):
        raise InputError(f"{type(mesh).__qualname__} is not Mesh: marrow.extract makes one, read_mesh reads one")
    return mesh


def read_mesh(path: Path) -> Mesh:
    """Read a mesh: STL, PLY, OBJ, VTP, 3MF, binary glTF, or STL in DICOM.

    Coordinates become millimetres in LPS: x and y are negated if the file states RAS. Several surfaces become
    one mesh. Normals are not read.

    Raises
    ------
    IoError
        The file is missing or cannot be read.
    InputError
        The extension is unknown, or the file is damaged.
    """
    arrays, _ = _marrow.read_mesh(path)
    return Mesh._of(arrays)


def write_meshes(
    meshes: Sequence[Mesh],
    path: Path,
    *,
    space: FileSpace = "LPS",
    verify: bool = False,
    progress: Optional[Progress] = None,
) -> None:
    """Write several meshes to one file, with their names, colours and trust: .obj, .vtp, .3mf or .glb.

    Parameters
    ----------
    meshes : sequence of Mesh
        At least one.
    path, space, verify, progress
        As for `Mesh.write`.

    Raises
    ------
    InputError, IoError, LimitError, Cancelled
        As `Mesh.write`; InputError also for no mesh, for a format that holds only one, and if only some of the
        meshes have trust.
    """
    _marrow.write_meshes([as_mesh(mesh)._surface() for mesh in meshes], path, space=space, progress=progress)
    if verify:
        _verify(meshes, path, space)


def _name(name: str) -> str:
    """Return the name, if files can hold it: they hold UTF-8."""
    try:
        name.encode()
    except (AttributeError, UnicodeEncodeError):
        raise InputError(f"the name of a mesh is Unicode text, not {name!r}") from None
    return name


def _colour(values: Optional[Sequence[float]]) -> Optional[Colour]:
    """Return red, green and blue, or None. Files hold no other numbers than from 0 to 1."""
    if values is None:
        return None
    red, green, blue = _numbers("colour", values, (3,)).tolist()
    if not all(0 <= value <= 1 for value in (red, green, blue)):
        raise InputError(f"colour is red, green and blue from 0 to 1, not {values!r}")
    return red, green, blue


def _linear_part(matrix: ArrayLike) -> NDArray[np.float64]:
    """Return the matrix that an affine of shape (4, 4) applies to steps; one of shape (3, 3) is that already."""
    array = as_numbers(matrix)
    if array is None:
        raise InputError(f"bound is not a matrix of numbers: {matrix!r}")
    if array.shape not in ((3, 3), (4, 4)):
        raise InputError(f"bound has the shape {array.shape} instead of (3, 3) or (4, 4)")
    return array[:3, :3]


def _verify(meshes: Sequence[Mesh], path: Path, space: FileSpace) -> None:
    arrays, stated = _marrow.read_mesh(path)
    found = Mesh._of(arrays)
    # Corners are compared, since STL has no list of points. .glb is rounded twice, to metres and back.
    written = np.concatenate([mesh.points[mesh.triangles] for mesh in meshes])
    if str(path).lower().endswith(".3mf"):  # it leaves out triangles with two equal corners
        corners = np.concatenate([mesh.triangles for mesh in meshes])
        written = written[(corners != np.roll(corners, 1, axis=1)).all(axis=1)]
    read = found.points[found.triangles]
    relative = absolute = 0.0
    if str(path).lower().endswith(".glb"):
        float32 = np.finfo(np.float32)
        relative, absolute = float(float32.eps), 1000 * float(float32.smallest_subnormal)  # of metres
    is_same = written.shape == read.shape and np.allclose(written, read, rtol=relative, atol=absolute)
    if stated != space or not is_same:
        raise IoError(f"'{path}' differs from what was written")


def _vectors(name: str, values: ArrayLike) -> NDArray[np.float32]:
    array = as_array(values)
    if array.ndim != 2 or array.shape[1] != 3:
        raise InputError(f"{name} have the shape {array.shape} instead of (n, 3)")
    if array.dtype.kind not in "iuf":
        raise InputError(f"{name} cannot be of type {array.dtype}")
    return np.require(array, np.float32, ["C", "A"])


def _indices(values: ArrayLike, points: int) -> Array:
    array = as_array(values)
    if array.ndim != 2 or array.shape[1] != 3:
        raise InputError(f"triangles have the shape {array.shape} instead of (m, 3)")
    if array.dtype.kind not in "iu":
        raise InputError(f"triangles are indices, and cannot be of type {array.dtype}")
    if array.size and (array.min() < 0 or array.max() >= points):
        raise InputError(f"a triangle names a point that does not exist: there are {points}")
    return np.require(array, np.int32 if points <= 2**31 else np.uint32, ["C", "A"])
