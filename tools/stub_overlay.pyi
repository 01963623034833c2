"""What `tools/write_stub.py` adds to the signatures of the compiled module.

The lines before `_Families` begin the stub. `_Families` are classes that unions are written by, and from which their
members seem to be derived, so that checkers find a type for lists of them. The next three have types by name, for
signatures that say no more than `object`, `str` or an array: `_Words` of parameters and properties of the public
interface; `_Parameters`, to which None is added if it is the default; and `_Results` of properties, functions and
constants. In the classes after them, `name: type` is the type of one property, and a function gives those parameters
and the result of the compiled one that differ, or adds one that Python attaches.
"""

from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from os import PathLike
from typing import Any, Literal, SupportsIndex, TypedDict, overload

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray
from typing_extensions import Self, Unpack

from .base.results import (
    ClosestPoints,
    Components,
    Crossings,
    Hits,
    HopStatistics,
    Measurement,
    MeshReport,
    Paging,
    PrintReport,
    SurfaceSamples,
    Visibility,
)
from .cameras import ProjectionPlaneCamera
from .cameras.camera import _Camera
from .clips import _Cut
from .color_rules.rule import _ColorRule
from .io.volume_data import VolumeData
from .lights import _Light
from .looks import AmbientOcclusion, Material, Outline, Phong
from .looks.shadings import _Look
from .picture.environments import EnvironmentLight
from .viewer import Viewer

_Progress = Callable[[float], object] | bool | None  # True: a bar
_Size = tuple[int, int]
_ColorMap = str | Callable[..., object] | ArrayLike  # a callable: matplotlib's Colormap
_Point = tuple[float, float, float]
_CameraPosition = tuple[_Point, _Point, _Point]
_OpenCv = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]
_Background = str | ArrayLike | None
_Placeable = Any  # an Isosurface, a Mesh, or a mesh of trimesh, PyVista, VTK or meshio
_Color = str | ArrayLike | _ColorRule
_GivenColor = NDArray[np.float64] | _ColorRule
_Shading = Phong | Outline | AmbientOcclusion

_Layer = (
    Literal["depth", "position", "normal", "albedo", "gradient_magnitude", "curvature", "ambient_occlusion"]
    | Literal["direct", "variance", "geometry_ids", "primitive_ids", "certified"]
)
_HitOutput = Literal[
    "t_hit",
    "geometry_ids",
    "primitive_ids",
    "primitive_normals",
    "positions",
    "primitive_uvs",
    "gradient_magnitudes",
    "dt_dlevel",
    "dt_dorigin",
    "dt_ddirection",
    "grazing",
    "dnormal_dlevel",
    "dnormal_dorigin",
    "dnormal_ddirection",
    "coefficient_indices",
    "coefficient_weights",
    "coefficient_gradients",
]

class _ModelOptions(TypedDict, total=False):
    degree: int
    boundary: Literal["mirror", "periodic"]
    filter: Literal["interpolate", "none", "smoothing"]
    smoothing: float
    unit: str
    patient: bool
    progress: _Progress

class _Value:
    def replace(self, **changes: Any) -> Self: ...

class _Shown:
    def save(self, path: str | PathLike[str], *arguments: Any, **options: Any) -> None: ...
    def show(self, **options: Any) -> Viewer: ...

class DamagedStore(OSError, ValueError): ...

class _Families:  # those of compiled classes become classes of the stub
    _Camera: PerspectiveCamera | ProjectionPlaneCamera | OrthographicCamera | PanoramicCamera

class _Words:
    axes: Literal["zyx", "xyz"]
    boundary: Literal["mirror", "periodic"]
    build_quality: Literal["low", "medium", "high"]
    encoding: Literal["linear", "srgb8"]
    filter: Literal["interpolate", "none", "smoothing"]
    inside: Literal["above", "below"]
    method: Literal["max_sphere", "ray"]

class _Parameters:
    background: _Background
    clip: _Cut | Sequence[_Cut]
    color: _Color
    dtype: DTypeLike
    geometry_id: SupportsIndex
    hits: dict[str, NDArray[Any]]
    layers: Iterable[_Layer]
    light: _Light
    look: _Look
    name: str
    named: object
    obj: _Placeable
    objects: _Placeable | Iterable[_Placeable | tuple[_Placeable, ArrayLike | None]]
    opacity: float
    out: dict[str, NDArray[Any]]
    outputs: Iterable[_HitOutput]
    progress: _Progress
    surface: Isosurface
    vertices: ArrayLike | object
    volume: Volume | VolumeData | NDArray[Any]

class _Results:
    _camera_to_opencv: _OpenCv
    _left_corners: tuple[NDArray[np.float64], NDArray[np.float64]]
    LAYERS: tuple[str, ...]
    area: Measurement
    cast_rays: Hits
    closest_points: ClosestPoints
    color: _GivenColor | None
    colors: NDArray[np.float64] | None
    components: Components
    compute_closest_points: ClosestPoints
    compute_distance: NDArray[np.float64]
    compute_occupancy: NDArray[np.float32]
    enclosed_volume: Measurement
    gaussian_curvature: Measurement
    list_intersections: Crossings
    mean_curvature: Measurement
    method: Literal["exact", "reference", "bracket"]
    normals: NDArray[np.float64] | None
    object: Isosurface | Mesh
    paging: Paging | None
    render_part: tuple[Image, dict[str, Any]]
    sample_points: SurfaceSamples
    shape: tuple[int, int, int]
    statistics: HopStatistics
    values: NDArray[np.float64] | None
    visibility: Visibility
    _as_array: NDArray[Any]
    _cast_touching_rays: Hits
    _prefilter_block: NDArray[np.float32]
    _placed_objects: list[tuple[int, Isosurface | Mesh, NDArray[np.float64], Visibility]]

class ColorByThickness:
    method: Literal["max_sphere", "ray"]
    surface: Isosurface | None

class Volume(_Shown):
    def adjoint(self, indices: ArrayLike, weights: ArrayLike) -> NDArray[np.float64]: ...
    def coefficient_weights(
        self, points: ArrayLike
    ) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]: ...
    @classmethod
    def from_nibabel(cls, image: object, **options: Unpack[_ModelOptions]) -> Self: ...
    @classmethod
    def from_pyvista(cls, image_data: object, scalars: str | None = None, **options: Unpack[_ModelOptions]) -> Self: ...
    @classmethod
    def from_sitk(cls, image: object, **options: Unpack[_ModelOptions]) -> Self: ...
    @classmethod
    def from_vtk(cls, image_data: object, scalars: str | None = None, **options: Unpack[_ModelOptions]) -> Self: ...
    @classmethod
    def from_xarray(
        cls, array: object, dims: Sequence[Hashable] | None = None, **options: Unpack[_ModelOptions]
    ) -> Self: ...
    def to_pyvista(self) -> Any: ...

class Isosurface(_Shown):
    def _measure_gradient(
        self, by_volume: float, by_area: float, order: int, coefficients: bool, progress: _Progress
    ) -> tuple[float, Any]: ...
    material: Material | None
    @overload
    def contains(self, *, certify: Literal[False] = False) -> NDArray[np.bool_]: ...
    @overload
    def contains(self, *, certify: Literal[True]) -> NDArray[np.uint8]: ...
    @overload
    def to_mesh(self, *, return_distance: Literal[False] = False, return_report: Literal[False] = False) -> Mesh: ...
    @overload
    def to_mesh(
        self, tolerance: float, *, return_distance: Literal[True], return_report: Literal[False] = False
    ) -> tuple[Mesh, float]: ...
    @overload
    def to_mesh(
        self, tolerance: float, *, return_distance: Literal[False] = False, return_report: Literal[True]
    ) -> tuple[Mesh, MeshReport]: ...
    @overload
    def to_mesh(
        self, *, faces: int, return_distance: Literal[True], return_report: Literal[False] = False
    ) -> tuple[Mesh, float]: ...
    @overload
    def to_mesh(
        self, *, faces: int, return_distance: Literal[False] = False, return_report: Literal[True]
    ) -> tuple[Mesh, MeshReport]: ...
    def to_print_mesh(
        self, tolerance: float | None = None, *, faces: int | None = None, progress: _Progress = None
    ) -> tuple[Mesh, PrintReport]: ...
    def to_pyvista(
        self, tolerance: float | None = None, *, faces: int | None = None, for_print: bool = False
    ) -> Any: ...
    def to_trimesh(
        self, tolerance: float | None = None, *, faces: int | None = None, for_print: bool = False
    ) -> Any: ...
    def GetClassName(self) -> str: ...
    @overload
    def write(
        self,
        path: str | PathLike[str],
        tolerance: float | None = None,
        *,
        faces: int | None = None,
        for_print: Literal[False] = False,
        progress: _Progress = None,
    ) -> None: ...
    @overload
    def write(
        self,
        path: str | PathLike[str],
        tolerance: float | None = None,
        *,
        faces: int | None = None,
        for_print: Literal[True],
        progress: _Progress = None,
    ) -> PrintReport: ...

class Mesh(_Shown):
    material: Material | None
    @classmethod
    def from_meshio(cls, mesh: object, **options: Any) -> Self: ...
    @classmethod
    def from_pyvista(cls, mesh: object, **options: Any) -> Self: ...
    @classmethod
    def from_trimesh(cls, mesh: object, **options: Any) -> Self: ...
    @classmethod
    def from_vtk(cls, mesh: object, **options: Any) -> Self: ...
    def export(self, path: str | PathLike[str], *arguments: Any, **options: Any) -> None: ...
    def GetClassName(self) -> str: ...
    def to_meshio(self) -> Any: ...
    def to_pyvista(self) -> Any: ...
    def to_trimesh(self) -> Any: ...
    def write(self, path: str | PathLike[str], *, unit: str | None = None) -> None: ...

class Scene(_Shown):
    def __init__(self, *more: _Placeable | tuple[_Placeable, ArrayLike | None]) -> None: ...
    def __contains__(self, arg0: object) -> bool: ...
    def __iter__(self) -> Iterator[int]: ...
    def certificate(
        self, ray: ArrayLike, *, t_near: float = 0.0, t_far: float = ..., geometry_id: SupportsIndex | None = None
    ) -> dict[str, Any]: ...
    @overload
    def count_intersections(self, *, certify: Literal[False] = False) -> NDArray[np.int32]: ...
    @overload
    def count_intersections(self, *, certify: Literal[True]) -> NDArray[np.uint8]: ...
    def set_transform(self, transform: ArrayLike | None) -> None: ...
    @overload
    def test_occlusions(self, *, certify: Literal[False] = False) -> NDArray[np.bool_]: ...
    @overload
    def test_occlusions(self, *, certify: Literal[True]) -> NDArray[np.uint8]: ...

class PathTracer:
    lights: list[_Light | EnvironmentLight]

    def __init__(self, *, lights: Sequence[_Light | EnvironmentLight] | None = None) -> None: ...

class Image:
    albedo: NDArray[np.float32] | None
    ambient_occlusion: NDArray[np.float32] | None
    certified: NDArray[np.uint32] | None
    color: NDArray[np.float32] | None
    curvature: NDArray[np.float32] | None
    depth: NDArray[np.float32] | None
    direct: NDArray[np.float32] | None
    geometry_ids: NDArray[np.uint32] | None
    gradient_magnitude: NDArray[np.float32] | None
    normal: NDArray[np.float32] | None
    position: NDArray[np.float32] | None
    primitive_ids: NDArray[np.uint64] | None
    srgb8: NDArray[np.uint8] | None
    variance: NDArray[np.float32] | None
