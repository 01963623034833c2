"""Meshes for 3D printers: one closed piece without cavities, checked, and its unit in the file."""

from __future__ import annotations

import numpy as np

from ..base.handed import known
from ..base.progress import as_callable, part_of
from ..base.results import PrintReport
from ..base.system import warn
from ..interop.mesh_topology import components_of, equal_rows, open_edges, signed_volumes
from .cells import cell_shift, index_shape
from .public import from_state

# The farthest that a vertex at the border of the volume may be from it, in samples.
_ROUNDING = 1e-6

# A direction along which no edges of surfaces in a volume usually run.
_DIRECTION = (0.8019, 0.5345, 0.2673)


def to_print_mesh(self, tolerance=None, *, faces=None, progress=None):
    """See `Isosurface.to_print_mesh`."""
    progress = as_callable(progress)
    closed, count, hidden = _closed_solid(self, progress)
    is_proven = tolerance is not None or faces is not None
    made = closed.to_mesh(tolerance, faces=faces, return_report=is_proven, progress=part_of(progress, 1, 2))
    mesh, proven = made if is_proven else (made, None)
    _check_closed(mesh, closed)
    kept, cavities, solids = _largest_solid(mesh.vertices, mesh.faces)
    used, corners = np.unique(mesh.faces[kept], return_inverse=True)
    printed = known("Mesh")(mesh.vertices[used], corners.reshape(-1, 3), mesh.normals[used])
    report = PrintReport(
        pieces=max(count, hidden + solids),
        cavities=cavities,
        closed_at_border=_meets_border(printed.vertices, closed.volume),
        faces=len(printed.faces),
        watertight=_is_watertight_without_indices(printed),
    )
    if proven is not None:
        report.update(proven)
    return printed, report


def _closed_solid(surface, progress):
    """The closed surface, of the largest piece if no clip cuts it; how many pieces the whole solid has, and how many
    of them it does not have.
    """
    state = surface.__getstate__()
    if surface.largest not in (None, 1):
        raise ValueError(f"largest: expected 1 or None of a surface to print, got {surface.largest}")
    is_clipped = len(state["clip"]) > 0
    if is_clipped and not surface.capped:
        raise ValueError("capped: expected True of a surface to print that is clipped, got False")
    whole = _changed(state, closed=True, largest=0)
    if not np.isfinite(whole.bounds).all():
        raise ValueError(f"level: expected one with a surface to print, got {surface.level:g}, where there is none")
    count = len(whole.components(progress=part_of(progress, 0, 2)).cell_counts)
    if is_clipped:  # `largest` chooses before a clip, which may leave less of the largest piece than of another one
        return (_changed(state, closed=True) if surface.largest else whole), count, 0
    return (_changed(state, closed=True, largest=1), count, count - 1) if count > 1 else (whole, count, 0)


def _changed(state, **options):
    return from_state(known("Isosurface"), {**state, **options})


def _check_closed(mesh, surface):
    if len(mesh.faces) == 0:
        raise ValueError(f"level: expected one with a mesh to print, got {surface.level:g}, whose mesh has no faces")
    if count := open_edges(mesh.faces):
        name = "level" if surface.__getstate__()["mask"] is None else "mask"
        raise ValueError(f"{name}: expected one with a closed surface to print, got a mesh with {count} open edges")


def _largest_solid(vertices, faces):
    """The faces of the outer surface of the solid with the largest volume, how many cavities it has, and how many
    solids there are.
    """
    labels, count = components_of(faces, len(vertices))
    volumes = signed_volumes(vertices, faces, labels, count)
    shells, cavities = np.flatnonzero(volumes > 0), np.flatnonzero(volumes < 0)
    if len(shells) == 0:
        raise ValueError("level: expected one with a solid to print, got a surface that encloses no volume")
    owners = np.full(len(cavities), shells[0])
    if len(shells) > 1 and len(cavities) > 0:
        owners = _innermost_shells(vertices, faces, labels, volumes, cavities)
    solids = np.where(volumes > 0, volumes, -np.inf)
    has_owner = owners >= 0
    np.add.at(solids, owners[has_owner], volumes[cavities[has_owner]])
    largest = np.argmax(solids)
    return labels == largest, int(np.sum(owners == largest)), len(shells)


def _innermost_shells(vertices, faces, labels, volumes, cavities):
    """The smallest outer surface around each cavity, or -1: a ray from the cavity leaves those around it once more."""
    first = np.unique(labels, return_index=True)[1]
    origins = vertices[faces[first[cavities]]].mean(axis=1)
    rays = np.concatenate([origins, np.broadcast_to(_DIRECTION, origins.shape)], axis=1)
    crossings = known("Scene")([known("Mesh")(vertices, faces)]).list_intersections(rays)
    pairs = np.stack([crossings.ray_ids, labels[crossings.primitive_ids.astype(np.int64)]], axis=1)
    pairs, counts = np.unique(pairs, axis=0, return_counts=True)
    rows, around = pairs[(counts % 2 == 1) & (volumes[pairs[:, 1]] > 0)].T
    order = np.lexsort((-volumes[around], rows))  # the last one of a row is the smallest
    owners = np.full(len(cavities), -1)
    owners[rows[order]] = around[order]
    return owners


def _meets_border(vertices, volume):
    """Whether vertices are on the border of the volume's domain."""
    index = (vertices - volume.origin) @ np.linalg.inv(volume.direction * volume.spacing).T
    shift = cell_shift(volume)
    upper = np.array(index_shape(volume)) - 1 + shift
    return bool(((index < _ROUNDING - shift) | (index > upper - _ROUNDING)).any())


def _is_watertight_without_indices(mesh):
    """Whether the mesh is watertight in formats such as STL, in which vertices at one position are one."""
    faces = equal_rows(mesh.vertices)[1][mesh.faces]
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    count = open_edges(faces)
    if count:
        warn(
            f"the mesh to print touches itself along {count} edges where samples equal the level; "
            f"a level between the values of two samples avoids this"
        )
    return not count
