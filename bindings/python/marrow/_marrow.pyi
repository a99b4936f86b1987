"""The native module: it converts types and errors. The package above it is the public interface."""

import os
from collections.abc import Callable, Sequence
from typing import Any, Optional, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

__version__: str

_Path = Union[str, os.PathLike[str]]
_Progress = Optional[Callable[[float], Any]]
_Vector = tuple[float, float, float]
_MeshArrays = tuple[Any, Any, Any]  # points, triangles, normals or None
_PlacedArray = tuple[Any, Any, Any, Any, tuple[float, float]]  # array, spacing, origin, direction, rescale
_PartSurface = tuple[Any, Any, Any, Any, Any, bool]  # extent, points, triangles, normals or None, keys, topology
_PartCounts = tuple[Any, Any, Any, bool]  # extent, points, triangles by row, topology
_PartNumbers = tuple[Any, Any, Any, bool, int]  # extent, points, triangles by row, topology, hash of the counts
_SharedFile = tuple[Any, ...]
_LabelPart = tuple[Any, ...]  # whole, first, dims, net_keys, positions, positions before relaxation, surfaces

class Error(Exception): ...
class InputError(Error, ValueError): ...
class GeometryError(InputError): ...
class EmptySurface(InputError, RuntimeError): ...
class IoError(Error, OSError): ...
class LimitError(Error, MemoryError): ...
class Cancelled(Error): ...
class DeviceError(Error, RuntimeError): ...

class ArrayVolume:
    def __init__(
        self,
        array: NDArray[Any],
        spacing: ArrayLike,
        origin: ArrayLike,
        direction: ArrayLike,
        rescale: tuple[float, float] = ...,
    ) -> None: ...
    @property
    def is_copy(self) -> bool: ...
    @property
    def address(self) -> int: ...

class ArrayMesh:
    def __init__(self, points: ArrayLike, triangles: ArrayLike, normals: Optional[ArrayLike]) -> None: ...

class ArrayExtractor:
    def __init__(
        self,
        volume: ArrayVolume,
        *,
        closed: bool = False,
        normals: bool = True,
        snap: float = 0.0,
        topology: bool = False,
        threads: int = 0,
        device: str = "cpu",
    ) -> None: ...
    @property
    def device(self) -> Optional[str]: ...
    @property
    def failure(self) -> str: ...
    def extract(self, isovalue: float, *, level: int = 0, progress: _Progress = None) -> _MeshArrays: ...

def devices() -> list[tuple[str, str, str, int]]: ...

class ArrayPart:
    def __init__(
        self,
        array: NDArray[Any],
        array_first: Sequence[int],
        first: Sequence[int],
        dims: Sequence[int],
        whole: Sequence[int],
        spacing: ArrayLike,
        origin: ArrayLike,
        direction: ArrayLike,
    ) -> None: ...
    @property
    def array(self) -> NDArray[Any]: ...

class BoxReader:
    def __init__(self, path: _Path, *, spacing: Optional[NDArray[np.float64]]) -> None: ...
    @property
    def shape(self) -> tuple[int, int, int]: ...
    @property
    def dtype(self) -> np.dtype[Any]: ...
    @property
    def chunks(self) -> tuple[int, int, int]: ...
    @property
    def spacing(self) -> _Vector: ...
    @property
    def origin(self) -> _Vector: ...
    @property
    def direction(self) -> tuple[_Vector, _Vector, _Vector]: ...
    def read(
        self, first: Sequence[int], out: NDArray[Any], known: Optional[tuple[NDArray[np.uint8], NDArray[Any]]] = None
    ) -> None: ...

class FileOfParts:
    def __init__(self, path: _Path, points: int, triangles: int, *, normals: bool, space: str) -> None: ...
    @property
    def description(self) -> _SharedFile: ...
    def commit(self) -> None: ...
    def discard(self) -> None: ...

def extract_part(
    part: ArrayPart,
    isovalue: float,
    *,
    closed: bool,
    normals: bool,
    topology: bool,
    threads: int,
    progress: _Progress = None,
) -> _PartSurface: ...
def merge_parts(parts: list[_PartSurface], progress: _Progress = None) -> _MeshArrays: ...
def label_part_halo(relax: int) -> int: ...
def extract_label_part(
    part: ArrayPart, *, background: int, relax: int, threads: int, progress: _Progress = None
) -> _LabelPart: ...
def merge_label_parts(
    parts: list[_LabelPart], *, normals: bool, progress: _Progress = None
) -> dict[int, _MeshArrays]: ...
def count_part(
    part: ArrayPart, isovalue: float, *, closed: bool, topology: bool, threads: int, progress: _Progress = None
) -> _PartCounts: ...
def chunks_without_surface(
    part: ArrayPart, chunk: Sequence[int], isovalue: float, *, closed: bool, threads: int
) -> NDArray[np.uint8]: ...
def first_slice(counts: _PartCounts) -> _PartCounts: ...
def number_parts(
    parts: list[_PartCounts], next: list[_PartCounts], points_before: int, triangles_before: int
) -> list[_PartNumbers]: ...
def extract_to_shared_file(
    part: ArrayPart,
    numbers: _PartNumbers,
    isovalue: float,
    file: _SharedFile,
    *,
    closed: bool,
    topology: bool,
    threads: int,
    progress: _Progress = None,
) -> None: ...
def check_geometry(shape: Sequence[int], spacing: ArrayLike, origin: ArrayLike, direction: ArrayLike) -> None: ...
def extract(
    volume: ArrayVolume,
    isovalue: float,
    *,
    closed: bool = False,
    normals: bool = True,
    snap: float = 0.0,
    topology: bool = False,
    threads: int = 0,
    progress: _Progress = None,
) -> _MeshArrays: ...
def trust(
    volume: ArrayVolume,
    mesh: ArrayMesh,
    *,
    hounsfield: bool,
    padding: Optional[float] = None,
    near_walls: Optional[NDArray[np.bool_]] = None,
    walls_restored: Optional[bool] = None,
    threads: int = 0,
    progress: _Progress = None,
) -> dict[str, Any]: ...
class FoundWalls:
    def __init__(
        self,
        volume: ArrayVolume,
        isovalue: float,
        mesh: ArrayMesh,
        *,
        noise: Optional[float],
        padding: Optional[float],
        threads: int,
        progress: _Progress,
    ) -> None: ...
    @property
    def area(self) -> float: ...
    @property
    def areas(self) -> NDArray[np.float64]: ...
    @property
    def positions(self) -> NDArray[np.float64]: ...
    def restore(self) -> _PlacedArray: ...
    def near(self, mesh: ArrayMesh) -> NDArray[np.bool_]: ...

def tissue_presets() -> list[Any]: ...
def presets_apply(modality: str, is_dicom: bool, lowest: float) -> bool: ...
def marching_cubes(
    volume: ArrayVolume,
    isovalue: float,
    *,
    mask: Optional[ArrayVolume],
    inward: bool,
    closed: bool,
    snap: float,
    topology: bool,
    threads: int,
    progress: _Progress,
) -> tuple[NDArray[np.float32], NDArray[np.int32], NDArray[np.float32], NDArray[np.float32], bool]: ...
def crop(volume: ArrayVolume, lower: ArrayLike, upper: ArrayLike) -> _PlacedArray: ...
def median_filter(
    volume: ArrayVolume, radius: int, *, threads: int = 0, progress: _Progress = None
) -> _PlacedArray: ...
def gaussian_filter(
    volume: ArrayVolume, sigma: float, *, threads: int = 0, progress: _Progress = None
) -> _PlacedArray: ...
def resample_isotropic(
    volume: ArrayVolume, spacing: float, *, threads: int = 0, progress: _Progress = None
) -> _PlacedArray: ...
def histogram(volume: ArrayVolume, bins: int, padding: Optional[float] = None) -> dict[str, Any]: ...
def otsu(volume: ArrayVolume, padding: Optional[float]) -> float: ...
def otsu_contrast(volume: ArrayVolume, padding: Optional[float]) -> float: ...
def sweep(
    volume: ArrayVolume,
    isovalues: Union[Sequence[float], NDArray[Any]],
    *,
    topology: bool = False,
    threads: int = 0,
    progress: _Progress = None,
) -> dict[str, Any]: ...
def find_plateaus(
    isovalue: NDArray[Any],
    volume: NDArray[Any],
    area: NDArray[Any],
    triangles: NDArray[Any],
    spacing: float,
    contrast: float,
) -> list[tuple[float, float]]: ...
def labels(
    map: ArrayVolume,
    *,
    background: int = 0,
    relax: int = 40,
    normals: bool = True,
    threads: int = 0,
    progress: _Progress = None,
) -> dict[int, _MeshArrays]: ...
def count_labels(map: ArrayVolume, *, threads: int = 0, progress: _Progress = None) -> dict[int, int]: ...
def read_label_table(path: _Path) -> dict[int, tuple[str, Optional[_Vector]]]: ...
def default_label_colour(label: int) -> _Vector: ...
def measure(mesh: ArrayMesh, *, threads: int = 0) -> dict[str, Any]: ...
def triangle_quality(mesh: ArrayMesh) -> dict[str, Any]: ...
def check(
    mesh: ArrayMesh, min_wall: Optional[float], *, threads: int = 0, progress: _Progress = None
) -> dict[str, Any]: ...
def roughness(mesh: ArrayMesh, window: float, *, threads: int = 0, progress: _Progress = None) -> dict[str, Any]: ...
def mean_curvature(mesh: ArrayMesh, *, threads: int = 0, progress: _Progress = None) -> NDArray[np.float64]: ...
def distance(
    a: ArrayMesh, b: ArrayMesh, *, samples: int = 200_000, threads: int = 0, progress: _Progress = None
) -> tuple[float, float]: ...
def keep_components(
    mesh: ArrayMesh,
    *,
    count: Optional[int] = None,
    min_volume: float = 0.0,
    cavities: bool = True,
    threads: int = 0,
) -> _MeshArrays: ...
def smooth(
    mesh: ArrayMesh,
    *,
    iterations: int = 20,
    pass_band: float = 0.1,
    bound: Optional[ArrayLike] = None,
    max_move: Optional[float] = None,
    threads: int = 0,
    progress: _Progress = None,
) -> _MeshArrays: ...
def simplify(
    mesh: ArrayMesh,
    *,
    triangles: Optional[int] = None,
    max_error: Optional[float] = None,
    threads: int = 0,
    progress: _Progress = None,
) -> _MeshArrays: ...
def write_meshes(
    surfaces: Sequence[Any], path: _Path, *, space: str = "LPS", progress: _Progress = None
) -> None: ...
def read_mesh(path: _Path) -> tuple[_MeshArrays, str]: ...
def read(
    path: _Path,
    *,
    series: Optional[str] = None,
    spacing: Optional[NDArray[np.float64]] = None,
    resample: bool = False,
    volume: Optional[int] = None,
    level: Optional[int] = None,
    threads: int = 0,
    progress: _Progress = None,
) -> tuple[_PlacedArray, dict[str, Any]]: ...
def inspect(
    path: _Path,
    *,
    series: Optional[str] = None,
    spacing: Optional[NDArray[np.float64]] = None,
    resample: bool = False,
    volume: Optional[int] = None,
    level: Optional[int] = None,
    threads: int = 0,
    progress: _Progress = None,
) -> dict[str, Any]: ...
def extract_file_to_file(
    scan: _Path,
    isovalue: float,
    path: _Path,
    *,
    spacing: Optional[NDArray[np.float64]],
    max_memory: int,
    closed: bool,
    topology: bool,
    space: str,
    threads: int,
    progress: _Progress,
) -> tuple[int, int]: ...
def extract_slices_to_file(
    read: Callable[[int, int], NDArray[Any]],
    shape: Sequence[int],
    dtype: np.dtype[Any],
    slices_at_once: int,
    spacing: ArrayLike,
    origin: ArrayLike,
    direction: ArrayLike,
    rescale: tuple[float, float],
    isovalue: float,
    path: _Path,
    *,
    max_memory: int,
    closed: bool,
    topology: bool,
    space: str,
    threads: int,
    progress: _Progress,
) -> tuple[int, int]: ...
