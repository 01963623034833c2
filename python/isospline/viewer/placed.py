"""Objects of a scene, moved by their transforms."""

from __future__ import annotations

import numpy as np

from ..scene import Isosurface, Mesh, Volume
from ..scene.public import from_state
from ..scene.world_units import converts


class Placement:
    """Applies transforms to objects. Surfaces that share a volume and a transform share the moved volume."""

    def __init__(self):
        self._volumes = {}

    def __call__(self, item, transform):
        """The item itself for the identity, otherwise a copy in the scene's world."""
        if np.array_equal(transform, np.eye(4)):
            return item
        return placed_mesh(item, transform) if isinstance(item, Mesh) else self._surface(item, transform)

    def _surface(self, surface, transform):
        state = surface.__getstate__()
        key = (id(surface.volume), transform.tobytes())
        if key not in self._volumes:
            # Keep the old volume alive, too: otherwise another object could get its id().
            self._volumes[key] = (surface.volume, placed_volume(surface.volume, transform))
        inverse = np.linalg.inv(transform)
        # <n, x> >= offset, where x is inverse y
        normals, offsets = state["clip"][:, :3], state["clip"][:, 3]
        clip = np.column_stack([normals @ inverse[:3, :3], offsets - normals @ inverse[:3, 3]])
        clip /= np.linalg.norm(clip[:, :3], axis=1, keepdims=True)
        return from_state(Isosurface, {**state, "volume": self._volumes[key][1], "clip": clip})


def placed_volume(volume, transform):
    """The same model in another world, whose unit is not known if the transform converts it.

    Its coefficients are copied.
    """
    affine = transform @ volume.affine
    spacing = np.linalg.norm(affine[:3, :3], axis=0)
    world = {"spacing": spacing, "origin": affine[:3, 3], "direction": affine[:3, :3] / spacing}
    state = volume.__getstate__()
    return from_state(Volume, {**state, **world, "unit": "" if converts(transform) else state["unit"]})


def placed_mesh(mesh, transform):
    """A mesh with transformed vertices and normals."""
    linear = transform[:3, :3]
    # Mirroring reverses the order of a triangle's corners.
    faces = mesh.faces if np.linalg.det(linear) > 0 else mesh.faces[:, ::-1]
    normals = mesh.normals
    if normals is not None:
        normals = normals @ np.linalg.inv(linear)
        lengths = np.linalg.norm(normals, axis=1, keepdims=True)
        normals /= np.where(lengths > 0, lengths, 1)  # zero where a vertex has none
    attributes = normals, mesh._colors(), mesh.material, mesh.values, mesh.values_name
    return Mesh(mesh.vertices @ linear.T + transform[:3, 3], faces, *attributes)
