"""Volumes, isosurfaces, meshes and scenes: the classes of users, derived from those of the compiled module."""

from .isosurface import Isosurface
from .mesh import Mesh
from .mesh_files import read_mesh
from .ray_mesh_intersector import RayMeshIntersector
from .scene import Scene
from .shell import Shell
from .volume import Volume

__all__ = ["Isosurface", "Mesh", "RayMeshIntersector", "Scene", "Shell", "Volume", "read_mesh"]
