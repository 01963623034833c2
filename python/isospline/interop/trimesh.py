"""Meshes and scenes of trimesh."""

from __future__ import annotations

import numpy as np

from ..parameters import check_type
from .checks import library_of, to_mesh


def check_trimesh(mesh):
    """Check that it is a mesh or a scene of trimesh, and tell whether it is a scene."""
    with library_of("Mesh.from_trimesh"):
        import trimesh
    check_type(mesh, "mesh", (trimesh.Trimesh, trimesh.Scene), "a trimesh.Trimesh or trimesh.Scene")
    return isinstance(mesh, trimesh.Scene)


def mesh_from_trimesh(cls, mesh, **options):
    """Take over a mesh of trimesh, vertices and faces as they are.

    Parameters
    ----------
    mesh : trimesh.Trimesh or trimesh.Scene
        Of a scene, all meshes where its graph places them, one after the other.
    **options
        Of `Mesh`.

    Returns
    -------
    Mesh

    Raises
    ------
    TypeError
        Where `mesh` is something else, such as a point cloud.
    ValueError
        Where it has no faces, or a vertex that is not finite.
    ImportError
        Where trimesh is not installed: ``pip install isospline[interop]``.

    Examples
    --------
    >>> import trimesh, isospline
    >>> isospline.Mesh.from_trimesh(trimesh.creation.box()).faces.shape
    (12, 3)
    """
    if check_trimesh(mesh):
        mesh = mesh.to_mesh()
    return to_mesh(cls, np.asarray(mesh.vertices), np.asarray(mesh.faces), "mesh", options)
