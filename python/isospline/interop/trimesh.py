"""Meshes and scenes of trimesh."""

from __future__ import annotations

import numpy as np

from ..base.parameters import check_type
from .checks import attributes, library_of, names_of_values, to_mesh


def check_trimesh(mesh):
    """Check that `mesh` is a trimesh mesh or scene, and return whether it is a scene."""
    with library_of("Mesh.from_trimesh"):
        import trimesh
    check_type(mesh, "mesh", (trimesh.Trimesh, trimesh.Scene), "a trimesh.Trimesh or trimesh.Scene")
    return isinstance(mesh, trimesh.Scene)


def mesh_from_trimesh(cls, mesh, **options):
    """See `Mesh.from_trimesh`."""
    return to_mesh(cls, _arrays(mesh, _given_normals), "mesh", options)


def mesh_of_file(cls, scene):
    """The mesh of a scene that trimesh has just read, before it computes normals."""
    return to_mesh(cls, _arrays(scene, _stored_normals), "mesh", {})


def _arrays(mesh, normals_of):
    """The arrays of a mesh, or of all meshes of a scene."""
    if not check_trimesh(mesh):
        return _part(mesh, np.eye(4), normals_of)
    placed = (mesh.graph[node] for node in mesh.graph.nodes_geometry)
    shapes = ((mesh.geometry[name], place) for place, name in placed)
    return joined([_part(shape, place, normals_of) for shape, place in shapes if hasattr(shape, "faces")])


def _stored_normals(mesh):
    """The normals of vertices that a mesh has, given or computed; the property would compute them."""
    return np.asarray(mesh.vertex_normals) if "vertex_normals" in mesh._cache else None


def _given_normals(mesh):
    """The same without those that trimesh has computed, which it keeps as if they were given."""
    from trimesh.geometry import weighted_vertex_normals

    normals = _stored_normals(mesh)
    if normals is None:
        return None
    computed = weighted_vertex_normals(len(mesh.vertices), mesh.faces, mesh.face_normals, mesh.face_angles)
    return None if np.allclose(normals, computed, rtol=0, atol=1e-12) else normals


def _part(mesh, place, normals_of):
    """The arrays of a mesh, moved by a (4, 4) matrix."""
    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    visual = mesh.visual
    colors = visual.vertex_colors if visual.kind == "vertex" else None
    if visual.kind == "texture":
        colors = visual.vertex_attributes.get("color")
    return moved({"vertices": vertices, "faces": faces, **attributes(normals_of(mesh), colors, _named(mesh))}, place)


def moved(arrays, place):
    """The arrays of a mesh, moved by a (4, 4) matrix. Mirrored faces are turned, so that their outer side stays so."""
    if np.array_equal(place, np.eye(4)):
        return arrays
    linear = place[:3, :3]
    cofactors = np.cross(np.roll(linear, -1, axis=0), np.roll(linear, -2, axis=0))
    volume = linear[0] @ cofactors[0]  # the determinant
    found = arrays | {"vertices": arrays["vertices"] @ linear.T + place[:3, 3]}
    if volume < 0:
        found["faces"] = arrays["faces"][:, ::-1]
    if "normals" in arrays:
        # By the inverse, transposed; by the cofactors for what becomes flat, which has no inverse.
        found["normals"] = arrays["normals"] @ (cofactors.T / (volume or 1.0))
    return found


def _named(mesh):
    """The arrays of the vertices, with their names."""
    found = list(mesh.vertex_attributes.items())
    # Other properties of a PLY file are only in its raw content.
    raw = mesh.metadata.get("_ply_raw", {}).get("vertex", {})
    names = names_of_values(list(raw.get("properties", ())))
    found += [(name, raw["data"][name]) for name in names if raw.get("length") == len(mesh.vertices)]
    return found


def joined(parts):
    """The arrays of several meshes, one after the other, with those attributes that all have."""
    if len(parts) == 1:
        return parts[0]
    if not parts:
        return {"vertices": np.empty((0, 3)), "faces": np.empty((0, 3), int)}
    first = np.cumsum([0, *(len(part["vertices"]) for part in parts)])
    joined = {"faces": np.concatenate([part["faces"] + offset for part, offset in zip(parts, first)])}
    for name in ("vertices", "normals", "colors"):
        if all(name in part for part in parts):
            joined[name] = np.concatenate([part[name] for part in parts])
    if len({part.get("values_name") for part in parts}) == 1 and "values" in parts[0]:
        joined["values"] = np.concatenate([part["values"] for part in parts])
        joined["values_name"] = parts[0]["values_name"]
    return joined
