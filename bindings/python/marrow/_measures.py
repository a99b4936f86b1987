"""What is measured on meshes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Optional


@dataclass(frozen=True)
class MeshMeasures:
    """The size and the topology of a mesh.

    Attributes
    ----------
    points, triangles : int
        Their numbers.
    components : int
        Sets of triangles that are connected through shared points.
    cavities : int
        Components that are closed and face inward.
    boundary_edges : int
        Edges with one triangle; a closed mesh has none.
    nonmanifold_edges : int
        Edges with more than two triangles, or with two of different orientation.
    euler_characteristic : int
        Points - edges + triangles.
    area : float
        The area in mm^2.
    volume : float
        The enclosed volume in mm^3; only meaningful without boundary edges.
    lower, upper : tuple of 3 floats
        The corners (x, y, z) of the bounding box, in mm.
    """

    points: int
    triangles: int
    components: int
    cavities: int
    boundary_edges: int
    nonmanifold_edges: int
    euler_characteristic: int
    area: float
    volume: float
    lower: tuple[float, float, float]
    upper: tuple[float, float, float]


@dataclass(frozen=True)
class MeshCheck:
    """Whether a mesh is fit to be printed and measured.

    Attributes
    ----------
    measures : MeshMeasures
        Its size and its topology.
    misoriented_edges : int
        Edges whose two triangles run in the same direction.
    nonmanifold_points : int
        Points whose triangles form several fans.
    unused_points : int
        Points without a triangle.
    degenerate_triangles : int
        Triangles without area or with two equal indices.
    cavities : int
        Closed components that face inward.
    genus : int or None
        The handles of all components; None unless closed and manifold, without misoriented edges.
    self_intersections : int
        Pairs of triangles at which the surface passes through itself, decided exactly.
    thin_triangles : int
        Triangles with a wall thinner than `min_wall` behind them.
    thin_area : float
        The area of these triangles in mm^2.
    thinnest_wall : float or None
        mm; None without thin triangles.
    is_closed : bool
        There are triangles, and no boundary edges.
    is_manifold : bool
        No edge has more than two triangles, and no point several fans; misoriented edges are allowed.
    is_oriented : bool
        Neighbours agree on the outside, and a closed mesh faces outward, except for cavities.
    is_sound : bool
        All three, without self-intersections and degenerate triangles: a slicer has nothing to repair. Thin walls do
        not count.
    """

    measures: MeshMeasures
    misoriented_edges: int
    nonmanifold_points: int
    unused_points: int
    degenerate_triangles: int
    cavities: int
    genus: Optional[int]
    self_intersections: int
    thin_triangles: int
    thin_area: float
    thinnest_wall: Optional[float]
    is_closed: bool
    is_manifold: bool
    is_oriented: bool
    is_sound: bool


@dataclass(frozen=True)
class TriangleQuality:
    """The shape of the triangles of a mesh.

    Attributes
    ----------
    smallest_angle : float
        Degrees; 0 if a triangle has no area.
    angle_histogram : tuple of 18 ints
        The numbers of all angles, in bins of 10 degrees.
    median_aspect_ratio : float
        Of the longest edge to the radius of the inscribed circle; 1 for an equilateral triangle.
    largest_aspect_ratio : float
        Infinite if a triangle has no area.
    triangles_without_area : int
        Their number.
    """

    smallest_angle: float
    angle_histogram: tuple[int, ...]
    median_aspect_ratio: float
    largest_aspect_ratio: float
    triangles_without_area: int


@dataclass(frozen=True)
class Roughness:
    """How rough a surface is, after Visutsak 2020 and Lavoue 2009.

    Attributes
    ----------
    roughness : float
        1/mm: the mean of |H - the mean of H over the window|, where H is the mean curvature; 0 for planes and spheres.
    mean_curvature : float
        1/mm: the mean of |H|.
    points : int
        Points that have a curvature.
    """

    roughness: float
    mean_curvature: float
    points: int


class Distance(NamedTuple):
    """The symmetric distance between two surfaces.

    Attributes
    ----------
    mean : float
        mm; over the area, averaged over both directions.
    max : float
        mm; the Hausdorff distance, as far as the samples show it.
    """

    mean: float
    max: float
