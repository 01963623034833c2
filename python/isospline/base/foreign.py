"""Names of other libraries, and what their users mean by them here.

This table makes the errors for unknown names and keywords, and the table of docs/migration.md.
"""

from __future__ import annotations

import difflib
from typing import Any

_SURFACE = "Isosurface(volume, level)"
_MESH = "Mesh(vertices, faces)"
_VOLUME = "Volume(array, spacing=..., origin=...)"
_CAMERA = "PerspectiveCamera(eye, target) or camera_for(scene)"
_OPENCV = "ProjectionPlaneCamera.from_opencv(intrinsics, rotation, translation, size=...)"
_CAST = "Scene(surface).cast_rays(origins, directions)"
_INSIDE = "Scene(mesh).occupancy(points)"
_LARGEST = "Isosurface(volume, level, largest=1)"
_TRIMESH = "mesh.to_trimesh()"

#: For the module and each class: names of other libraries, and what is meant.
NAMES: dict[str, dict[str, str]] = {
    "isospline": {
        "Camera, PinholeCamera, PinholeCameraIntrinsic": f"{_CAMERA} or {_OPENCV}",
        "show, plot, draw, draw_geometries, Viewer": "view(surface)",
        "Plotter, Renderer, RenderWindow": "render(scene, camera) for pictures or view(scene) for the viewer",
        "set_num_threads, set_threads, num_threads": "set_thread_count(count)",
        "get_num_threads, threads": "thread_count()",
        "to_pyvista, to_trimesh": "surface.to_pyvista() or surface.to_trimesh()",
        "contour, isosurface, marching_cubes, MarchingCubes, FlyingEdges3D, extract_surface": _SURFACE,
        "Actor": "Isosurface(volume, level, color=..., opacity=...)",
        "TriangleMesh, PolyData, Trimesh, Surface": _MESH,
        "ImageData, UniformGrid, Image3D, Grid": _VOLUME,
        "RaycastingScene": "Scene(objects)",
        "intersect, ray_trace, cast_rays": _CAST,
        "largest, extract_largest": _LARGEST,
        "read, load, imread, open": "read_volume(path) or read_mesh(path)",
        "load_mesh, read_triangle_mesh": "read_mesh(path)",
        "load_volume, read_nifti, read_dicom": "read_volume(path)",
        "save, write, imwrite, export": "image.save(path) or mesh.save(path)",
        "thickness": "surface.thickness(points)",
        "porosity": "1 - surface.enclosed_volume() / volume_of_the_box",
        "distance, compare": "surface_distance(surface, other)",
        "animate, Animation": "write_video(path, images)",
        "orbit, spin": "turntable(scene, count)",
        "Light": "DirectionalLight(direction) or PositionalLight(position)",
        "Plane, clip": "HalfSpace(point, normal)",
        "Sphere, Torus": "volumes.sphere() or volumes.torus()",
        "ColorByArray, LookupTable": "ColorByVolume(volume, cmap)",
        "threshold, otsu": "suggest_levels(data)",
        "Legend, add_legend": "render(surfaces, legend=True)",
        "ScalarBar, add_scalar_bar": "render(surface, annotate=True)",
        "Dataset, VolumeReader": "read_volume(path)",
        "prefilter_to": "convert(data, path)",
        "level_of_detail_for": "scale_for(store, camera, size)",
        "VoxelHopper": "research.VoxelHopper(surface)",
        "color, dicom, all": "pip install isospline[color], [io] or [all]",
    },
    "Scene": {
        "intersect, intersects_location, raycast, ray_trace, trace": "cast_rays(origins, directions)",
        "add_triangles, add_mesh, add_geometry, add_actor, add_volume, append": "add(surface)",
        "render, screenshot, plot": "render(scene, camera)",
        "camera": "camera_for(scene)",
        "contains, inside": "occupancy(points)",
        "objects, geometry, geometries, meshes": "[scene.object(id) for id in scene.ids]",
        "apply_transform": "set_transform(geometry_id, matrix)",
        "to_mesh, to_pyvista, to_trimesh, export, write": "surface.to_mesh() of each object",
        "distance, closest_point, nearest": "closest_points(points)",
        "set_background, background": "render(scene, background=...)",
        "level": "surface.level of an object",
    },
    "Isosurface": {
        "keep_largest, extract_largest, connectivity, split": f"{_LARGEST} or components()",
        "contour, set_level, isovalue, threshold": "with_level(level) or surface.level = level",
        "intersect, cast_rays, ray_trace, intersects_location": _CAST,
        "vertices, faces, points, triangles, n_points": "to_mesh().vertices and to_mesh().faces",
        "normals, vertex_normals": "to_mesh().normals or closest_points(points).primitive_normals",
        "surface_area": "area()",
        "porosity": "1 - surface.enclosed_volume() / volume_of_the_box",
        "integrate, mass_properties": "enclosed_volume() and area()",
        "curvature": "mean_curvature() or ColorByCurvature(kind, limits=...)",
        "distance, compute_distance, compute_signed_distance": "signed_distance(points)",
        "closest_point, nearest": "closest_points(points)",
        "occupancy, is_inside": "contains(points)",
        "smooth": 'Volume(array, filter="smoothing", smoothing=...)',
        "decimate, simplify, triangulate": "to_mesh(tolerance)",
        "clip, cut, slice": "Isosurface(volume, level, clip=HalfSpace(point, normal))",
        "is_watertight, cap": "Isosurface(volume, level, closed=True)",
        "render, plot, screenshot": "render(surface)",
        "rotate, translate, transform, apply_transform": "Scene([(surface, matrix)])",
        "set_color, actor": "Isosurface(volume, level, color=...)",
        "export": 'save("part.stl")',
        "image, data": "surface.volume",
    },
    "Mesh": {
        "thickness": "Isosurface.thickness(points), of isosurfaces alone",
        "points, verts": "vertices",
        "triangles, cells, indices": "faces",
        "vertex_normals, point_normals": "normals",
        "vertex_colors": "colors",
        "point_data, scalars": "values",
        "area, volume, is_watertight, split, largest, smooth, decimate, simplify": f"{_TRIMESH}, which has it,",
        "ray, intersect, ray_trace, intersects_location": "RayMeshIntersector(mesh)",
        "contains, is_inside": _INSIDE,
        "closest_points, signed_distance, nearest": "Scene(mesh).closest_points(points) or .signed_distance(points)",
        "cast_rays": "Scene(mesh).cast_rays(origins, directions)",
        "apply_transform, translate, rotate, transform": "Scene([(mesh, matrix)])",
        "n_points, n_cells": "len(mesh.vertices) and len(mesh.faces)",
        "plot, render": "render(mesh)",
    },
    "Volume": {
        "contour, isosurface, threshold, marching_cubes": _SURFACE,
        "data, array, values, samples": "sample(points)",
        "evaluate, interpolate, map_coordinates, probe": "sample(points)",
        "gradient": "sample(points, derivative=1)",
        "hessian": "sample(points, derivative=2)",
        "min": "minimum",
        "max": "maximum",
        "range, scalar_range": "(volume.minimum, volume.maximum)",
        "dimensions, size": "shape",
        "voxel_size, pixdim": "spacing",
        "plot, render": "render(volume, level=...)",
        "smooth": 'Volume(array, filter="smoothing", smoothing=...)',
        "porosity": "1 - Isosurface(volume, level).enclosed_volume() / volume_of_the_box",
    },
    "VolumeData": {
        "contour, isosurface, threshold": "Isosurface(data, level)",
        "array, values, numpy, get_fdata, samples": "numpy.asarray(data)",
        "min, max, scalar_range": "range",
        "dimensions, size": "shape",
        "voxel_size, pixdim, zooms": "spacing",
        "sample, interpolate": "to_volume().sample(points)",
        "plot, render": "render(data, level=...)",
    },
    "Image": {
        "pixels, data, array, rgb, numpy": "numpy.asarray(image)",
        "shape": "size",
        "to_pil": "PIL.Image.fromarray(numpy.asarray(image))",
        "depth_map": "render(..., layers=['depth']).depth",
        "export": "save(path)",
    },
    "PerspectiveCamera": {
        "position, origin": "eye",
        "focal_point, look_at": "target",
        "view_up": "up",
        "fov, view_angle": "field_of_view",
    },
}

#: For each call: keywords of other libraries, and what is meant.
KEYWORDS: dict[str, dict[str, str]] = {
    "render": {
        "shading": "light=Phong(...)",
        "integrator": "light=PathTracer(...)",
        "lighting": "light=Studio()",
        "lights": "light=Phong(lights=[...]) or light=PathTracer(lights=[...])",
        "scalars, cmap, clim, colormap": "color=ColorByVolume(volume, cmap)",
        "material": "light=PathTracer(material=...)",
        "materials": "light=PathTracer(materials=...) or light=Studio(materials=...)",
        "show_scalar_bar, scalar_bar": "annotate=True",
        "view, projection": "camera=camera_for(scene, view=...)",
        "width, height": "size=(width, height)",
        "shadows": "light=Phong(shadows=True)",
        "labels": "legend=True, with Isosurface(..., name=...)",
        "transparent": "background=None",
        "filename, screenshot": "render(...).save(path)",
    },
    "Scene": {
        "color, opacity": "Isosurface(volume, level, color=..., opacity=...)",
        "camera": "render(scene, camera)",
    },
    "Isosurface": {
        "smooth": 'Volume(array, filter="smoothing", smoothing=...)',
        "spacing, origin, direction, degree": "Volume(array, spacing=..., degree=...)",
        "transform": "Scene([(surface, matrix)])",
        "method, prune_depth, prune_border": "research.isosurface(volume, level, method=..., prune_depth=...)",
        "cmap": "color=ColorByVolume(volume, cmap)",
        "label": "name",
    },
    "Mesh": {"transform": "Scene([(mesh, matrix)])", "scalars": "values", "label": "name"},
    "camera_for": {"position, eye": "PerspectiveCamera(eye, target)"},
    "turntable": {"n_frames, frames, steps": "count", "path, filename": "write_video(path, images)"},
    "DirectionalLight": {"position": "PositionalLight(position)", "color": "intensity"},
    "PathTracer": {"samples, spp": "render(scene, light=PathTracer(), samples=...)"},
    "Volume": {"level": _SURFACE},
    "read_volume": {"level": "Isosurface(data, level)"},
    "open_volume": {"level, level_of_detail": "scale"},
}


def _spread(table: dict[str, str]) -> dict[str, str]:
    return {name: meaning for names, meaning in table.items() for name in names.split(", ")}


_NAMES = {owner: _spread(table) for owner, table in NAMES.items()}
_KEYWORDS = {call: _spread(table) for call, table in KEYWORDS.items()}


def meaning_of_name(owner: str, name: str, known: list[str]) -> str | None:
    """What is probably meant by an unknown name of the module or of a class."""
    meant = _NAMES.get(owner, {}).get(name)
    if meant is None:
        close = difflib.get_close_matches(name, [each for each in known if not each.startswith("_")], 1, 0.75)
        meant = close[0] if close else None
    return meant


def meaning_of_keyword(call: str, keyword: str) -> str | None:
    """What is probably meant by an unknown keyword of a call."""
    return _KEYWORDS.get(call, {}).get(keyword)


def unknown_name(owner: str, name: str, known: list[str], is_module: bool = False) -> AttributeError:
    """The error for an unknown name."""
    meant = None if name.startswith("_") else meaning_of_name(owner, name, known)
    what = f"module {owner!r}" if is_module else f"{owner!r} object"
    return AttributeError(f"{what} has no attribute {name!r}" + (f"; did you mean {meant}?" if meant else ""))


def answer(*classes: type) -> None:
    """Make classes answer unknown names."""

    def missing(self: Any, name: str) -> Any:
        if hasattr(type(self), name):  # a property, whose own error it was
            return object.__getattribute__(self, name)
        raise unknown_name(type(self).__name__, name, dir(type(self)))

    for each in classes:
        each.__getattr__ = missing  # type: ignore[attr-defined]


def table_of_names() -> str:
    """The table of docs/migration.md; docs/names.py writes it there."""
    rows = ["| Elsewhere | isospline |", "|---|---|"]
    for owner, table in NAMES.items():
        for names, meaning in table.items():
            prefix = "" if owner == "isospline" else f"{owner}."
            theirs = ", ".join(f"{prefix}{name}" for name in names.split(", "))
            rows.append(f"| {theirs} | `{meaning}` |")
    for call, table in KEYWORDS.items():
        for names, meaning in table.items():
            theirs = ", ".join(f"{call}({name}=)" for name in names.split(", "))
            rows.append(f"| {theirs} | `{meaning}` |")
    return "\n".join(rows)
