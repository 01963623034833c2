"""Isosurfaces of B-spline volume models, ray traced exactly in Embree."""

from importlib import import_module as _import_module
from typing import TYPE_CHECKING as _TYPE_CHECKING
from typing import Any as _Any

from . import _core, certificates, derivatives, volumes
from ._core import INVALID_ID, INVALID_PRIMITIVE_ID, Cancelled
from .base import foreign, values
from .base.results import (
    ClosestPoints,
    Components,
    Crossings,
    Hits,
    LabelComparison,
    LabelMeasures,
    LabelTable,
    LevelMeasures,
    Measurement,
    SurfaceDistance,
)
from .base.threads import set_thread_count, thread_count
from .cameras import OrthographicCamera, PanoramicCamera, PerspectiveCamera, ProjectionPlaneCamera
from .clips import Box, HalfSpace
from .color_rules import (
    ColorByCurvature,
    ColorByDepth,
    ColorByDistance,
    ColorByNormal,
    ColorByThickness,
    ColorByValue,
    ColorByVolume,
    ridges_and_valleys,
)
from .distances import hausdorff_distance, surface_distance
from .io import VolumeData, read_volume
from .labels import Labels
from .lights import DirectionalLight, PositionalLight, RectangleLight, SphereLight
from .levels import suggest_levels
from .looks import AmbientOcclusion, Material, Outline, Phong
from .measures import measure
from .picture.animation import animate, turntable
from .picture.cameras import camera_for, turntable_cameras
from .picture.environments import EnvironmentLight, read_environment
from .picture.ground import ground_for
from .picture.image import Image
from .picture.path_tracer import PathTracer
from .picture.plotter import add_to_plotter
from .picture.progressive import ProgressiveRenderer, render_progressive
from .picture.rendering import render
from .picture.studio import Studio
from .picture.video import write_video
from .suggest.presentation import suggest_mask, suggest_view
from .scene import Isosurface, Mesh, RayMeshIntersector, Scene, Volume, read_mesh
from .store import convert, open_volume, scale_for
from . import research, showing

from . import distributed  # last, because it imports from the other modules

if _TYPE_CHECKING:
    from .viewer import view

__version__ = _core.__version__


def __getattr__(name: str) -> _Any:
    if name in ("view", "viewer"):  # most programs do without
        viewer = _import_module("isospline.viewer")
        return globals().setdefault("view", viewer.view) if name == "view" else viewer
    if name == "torch":
        return _import_module("isospline.torch")
    raise foreign.unknown_name("isospline", name, __all__, is_module=True)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]


__all__ = [
    "INVALID_ID",
    "INVALID_PRIMITIVE_ID",
    "AmbientOcclusion",
    "Box",
    "Cancelled",
    "ClosestPoints",
    "ColorByCurvature",
    "ColorByDepth",
    "ColorByDistance",
    "ColorByNormal",
    "ColorByThickness",
    "ColorByValue",
    "ColorByVolume",
    "Components",
    "Crossings",
    "DirectionalLight",
    "EnvironmentLight",
    "HalfSpace",
    "Hits",
    "Image",
    "Isosurface",
    "LabelComparison",
    "LabelMeasures",
    "LabelTable",
    "Labels",
    "LevelMeasures",
    "Material",
    "Measurement",
    "Mesh",
    "OrthographicCamera",
    "Outline",
    "PanoramicCamera",
    "PathTracer",
    "PerspectiveCamera",
    "Phong",
    "PositionalLight",
    "ProgressiveRenderer",
    "ProjectionPlaneCamera",
    "RayMeshIntersector",
    "RectangleLight",
    "Scene",
    "SphereLight",
    "Studio",
    "SurfaceDistance",
    "Volume",
    "VolumeData",
    "add_to_plotter",
    "animate",
    "camera_for",
    "certificates",
    "convert",
    "derivatives",
    "distributed",
    "ground_for",
    "hausdorff_distance",
    "measure",
    "open_volume",
    "read_environment",
    "read_mesh",
    "read_volume",
    "render",
    "render_progressive",
    "research",
    "ridges_and_valleys",
    "scale_for",
    "set_thread_count",
    "suggest_levels",
    "suggest_mask",
    "suggest_view",
    "surface_distance",
    "thread_count",
    "turntable",
    "turntable_cameras",
    "view",
    "volumes",
    "write_video",
]
