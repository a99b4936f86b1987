"""What is measured on meshes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Optional


@dataclass(frozen=True)
class MeshMeasures:
    """The size and the topology of a mesh. Lengths are in mm."""

    points: int
    triangles: int
    components: int  #: sets of triangles that are connected through shared points
    cavities: int  #: components that are closed and face inward
    boundary_edges: int  #: edges with one triangle; a closed mesh has none
    nonmanifold_edges: int  #: edges with more than two triangles, or with two of different orientation
    euler_characteristic: int  #: points - edges + triangles
    area: float  #: mm^2
    volume: float  #: mm^3; only meaningful without boundary edges
    lower: tuple[float, float, float]  #: lower corner of the bounding box
    upper: tuple[float, float, float]  #: upper corner of the bounding box


@dataclass(frozen=True)
class MeshCheck:
    """Whether a mesh is fit to be printed and measured. Lengths are in mm."""

    measures: MeshMeasures
    misoriented_edges: int  #: edges whose two triangles run in the same direction
    nonmanifold_points: int  #: points whose triangles form several fans
    unused_points: int  #: points without a triangle
    degenerate_triangles: int  #: triangles without area or with two equal indices
    cavities: int  #: closed components that face inward
    genus: Optional[int]  #: handles of all components; None unless closed and manifold, without misoriented edges
    self_intersections: int  #: pairs of triangles at which the surface passes through itself, decided exactly
    thin_triangles: int  #: triangles with a wall thinner than `min_wall` behind them
    thin_area: float  #: mm^2; the area of these triangles
    thinnest_wall: Optional[float]  #: mm; None without thin triangles
    is_closed: bool
    is_manifold: bool
    is_oriented: bool  #: neighbours agree on the outside, and a closed mesh faces outward, except for cavities
    is_sound: bool  #: all of this, and nothing else that a slicer would have to repair; thin walls do not count


@dataclass(frozen=True)
class TriangleQuality:
    """The shape of the triangles of a mesh."""

    smallest_angle: float  #: degrees; 0 if a triangle has no area
    angle_histogram: tuple[int, ...]  #: all angles, in 18 bins of 10 degrees
    median_aspect_ratio: float  #: longest edge over inscribed radius; 1 for an equilateral triangle
    largest_aspect_ratio: float  #: infinite if a triangle has no area
    triangles_without_area: int


@dataclass(frozen=True)
class Roughness:
    """How rough a surface is, after Visutsak 2020 and Lavoue 2009."""

    roughness: float  #: 1/mm: the mean of |H - the mean of H over the window|; 0 for planes and spheres
    mean_curvature: float  #: 1/mm: the mean of |H|
    points: int  #: points that have a curvature


class Distance(NamedTuple):
    """The symmetric distance between two surfaces, in mm."""

    mean: float  #: over the area, averaged over both directions
    max: float  #: the Hausdorff distance, as far as the samples show it
