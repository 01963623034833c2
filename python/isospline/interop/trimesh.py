"""Meshes and scenes of trimesh."""

from __future__ import annotations

import numpy as np

from ..parameters import check_type
from .checks import library_of, to_mesh


def check_trimesh(mesh):
    """Check that `mesh` is a trimesh mesh or scene, and return whether it is a scene."""
    with library_of("Mesh.from_trimesh"):
        import trimesh
    check_type(mesh, "mesh", (trimesh.Trimesh, trimesh.Scene), "a trimesh.Trimesh or trimesh.Scene")
    return isinstance(mesh, trimesh.Scene)


def mesh_from_trimesh(cls, mesh, **options):
    """Convert a trimesh mesh, without changes of vertices and faces.

    Parameters
    ----------
    mesh : trimesh.Trimesh or trimesh.Scene
        For a scene, all meshes, placed by its graph, one after the other.
    **options
        Options of `Mesh`.

    Returns
    -------
    Mesh

    Raises
    ------
    TypeError
        If `mesh` is something else, such as a point cloud.
    ValueError
        If it has no faces, or a vertex that is not finite.
    ImportError
        If trimesh is not installed: ``pip install isospline[interop]``.

    Examples
    --------
    >>> import trimesh, isospline
    >>> isospline.Mesh.from_trimesh(trimesh.creation.box()).faces.shape
    (12, 3)
    """
    if check_trimesh(mesh):
        mesh = mesh.to_mesh()
    return to_mesh(cls, np.asarray(mesh.vertices), np.asarray(mesh.faces), "mesh", options)
