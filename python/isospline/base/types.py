"""Types of parameters that many functions share."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Literal, TypedDict, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    from ..color_rules.rule import _ColorRule

Progress = Callable[[float], object] | bool | None  # True: a bar
Point = tuple[float, float, float]
CameraPosition = tuple[Point, Point, Point]
Background = str | ArrayLike | None
ColorMap = str | Callable[..., object] | ArrayLike  # a callable: matplotlib's Colormap
Color = Union[str, ArrayLike, "_ColorRule"]
GivenColor = Union[NDArray[np.float64], "_ColorRule"]
Placeable = Any  # an Isosurface, a Mesh, or a mesh of trimesh, PyVista, VTK or meshio

Layer = Literal[
    "depth",
    "position",
    "normal",
    "albedo",
    "gradient_magnitude",
    "curvature",
    "ambient_occlusion",
    "direct",
    "variance",
    "geometry_ids",
    "primitive_ids",
    "certified",
    "mask",
]
HitOutput = Literal[
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


class ModelOptions(TypedDict, total=False):
    """The options of `Volume` without those of its place."""

    degree: int
    boundary: Literal["mirror", "periodic"]
    filter: Literal["interpolate", "none", "smoothing"]
    smoothing: float
    unit: str
    patient: bool
    progress: Progress
