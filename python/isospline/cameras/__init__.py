"""Cameras: an eye and a target, or an eye and a plane."""

from .projection_plane import ProjectionPlaneCamera
from .target_cameras import OrthographicCamera, PanoramicCamera, PerspectiveCamera

__all__ = ["OrthographicCamera", "PanoramicCamera", "PerspectiveCamera", "ProjectionPlaneCamera"]
