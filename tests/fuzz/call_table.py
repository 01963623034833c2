"""Every public callable with valid arguments, which are changed one by one."""

import inspect
import itertools

import numpy as np

import isospline as iso
from isospline import volumes
from isospline.base.values import value_types

# Not called: they need another library's objects, or a file.
LEFT_OUT = {
    *("Cancelled", "ClosestPoints", "Components", "Crossings", "Hits", "Image", "read_mesh", "Isosurface.shell"),
    *("LabelComparison", "LabelMeasures", "LabelTable", "SurfaceDistance.to_frame", "add_to_plotter"),
    "SurfaceDistance.to_csv",
    "LevelMeasures",
}


def objects():
    """One object of each class."""
    field = volumes.torus()
    made = {"volume": field.volume(12)}
    made["surface"] = iso.Isosurface(made["volume"], field.level)
    made["mesh"] = iso.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
    made["scene"] = iso.Scene([made["surface"], made["mesh"]])
    made["camera"] = iso.camera_for(made["scene"])
    made["plane_camera"] = iso.ProjectionPlaneCamera((0, -5, 0), right=(1, 0, 0), down=(0, 0, -1), center=(0, -4, 0))
    made["flat_camera"] = iso.OrthographicCamera((0, -5, 0), (0, 0, 0), height=3)
    made["panorama"] = iso.PanoramicCamera((0, -5, 0), (0, 0, 0))
    made["image"] = iso.render(made["scene"], made["camera"], size=(4, 4), light="phong")
    made["rays"] = np.array([[0, -3, 0.2, 0, 1, 0], [3, 0, 0, -1, 0, 0.0]])
    made["hits"] = made["scene"].cast_rays(made["rays"])
    made["material"] = iso.Material()
    made["hopper"] = iso.research.VoxelHopper(made["surface"])
    made["intersector"] = iso.RayMeshIntersector(made["surface"])
    made["progressive"] = iso.ProgressiveRenderer(made["scene"], made["camera"], size=(4, 4))
    made["data"] = iso.VolumeData(np.arange(60.0).reshape(3, 4, 5))
    numbers = np.zeros((8, 8, 8), np.uint8)
    numbers[2:6, 2:6, 2:4], numbers[2:6, 2:6, 4:6] = 1, 2
    made["labels"] = iso.Labels(numbers, names={1: "left", 2: "right"})
    made["position"] = ((0, -5, 0), (0, 0, 0), (0, 0, 1))
    return made


def write_files(folder):
    """Write the files that calls read."""
    samples = np.arange(60.0).reshape(3, 4, 5)
    np.save(folder / "a.npy", samples)
    iso.convert(samples, folder / "store.zarr")
    samples.tofile(folder / "a.raw")
    (folder / "sky.hdr").write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n" + bytes([9, 6, 3, 129] * 2))


def calls(o, folder):
    """(name, function, arguments) of each call; `folder` has the files of `write_files`, and is for others."""
    points, size, samples = [(0.1, 0.2, 0.3), (1, 1, 1)], (5, 4), np.arange(60.0).reshape(3, 4, 5)
    look = {"eye": (0, -5, 0), "target": (0, 0, 0), "up": (0, 0, 1)}
    picture = {
        "size": (4, 3),
        "background": (1, 0, 0),
        "layers": ("depth", "ambient_occlusion"),
        "ambient_occlusion_samples": 2,
        "encoding": "srgb8",
    }
    frame = {
        "view": "iso",
        "up": (0, 0, 1),
        "projection": "perspective",
        "field_of_view": 30.0,
        "size": size,
        "margin": 0.1,
    }
    near = {"t_near": 0.0, "t_far": 9.0}
    ray = {"ray_origins": o["rays"][:, :3], "ray_directions": o["rays"][:, 3:]}
    scene, surface = o["scene"], o["surface"]
    table = [
        (
            "AmbientOcclusion",
            iso.AmbientOcclusion,
            {
                "samples": 4,
                "distance": 1.0,
                "color": 1.0,
                "opacity": 1.0,
                "silhouette_opacity": 1.0,
                "silhouette_exponent": 2.0,
                "cap_color": None,
            },
        ),
        ("Box", iso.Box, {"minimum": (0, 0, 0), "maximum": (1, 1, 1)}),
        ("ColorByCurvature", iso.ColorByCurvature, {"kind": "mean", "cmap": "viridis", "limits": (-1, 1)}),
        ("ColorByDepth", iso.ColorByDepth, {"cmap": "viridis", "limits": (0, 1)}),
        (
            "ColorByDistance",
            iso.ColorByDistance,
            {"other": o["surface"], "cmap": "viridis", "limits": (0, 1), "signed": True, "label": "a"},
        ),
        ("ColorByNormal", iso.ColorByNormal, {}),
        (
            "ColorByThickness",
            iso.ColorByThickness,
            {
                "cmap": "viridis",
                "limits": (0, 1),
                "method": "ray",
                "ripple": 0.1,
                "surface": o["surface"],
                "transform": np.eye(4),
                "label": "a",
            },
        ),
        ("ColorByValue", iso.ColorByValue, {"cmap": "viridis", "limits": (0, 1), "label": "a"}),
        (
            "ColorByVolume",
            iso.ColorByVolume,
            {"volume": o["volume"], "cmap": [(0, 0, 0), (1, 1, 1)], "limits": (0, 1), "transform": np.eye(4)},
        ),
        ("DirectionalLight", iso.DirectionalLight, {"direction": (1, 0, 0), "intensity": 1.0, "angle": 5.0}),
        (
            "EnvironmentLight",
            iso.EnvironmentLight,
            {"radiance": 1.0, "image": np.ones((4, 8, 3)), "rotation": np.eye(3), "visible": True},
        ),
        ("HalfSpace", iso.HalfSpace, {"point": (0, 0, 0), "normal": (0, 0, 1)}),
        (
            "Isosurface",
            iso.Isosurface,
            {
                "volume": o["volume"],
                "level": 0.0,
                "mask": np.ones((12, 12, 12), bool),
                "largest": 1,
                "clip": [iso.Box((-1, -1, -1), (0, 1, 1))],
                "capped": True,
                "closed": True,
                "inside": "above",
                "material": o["material"],
                "progress": None,
            },
        ),
        (
            "Isosurface.closest_points",
            surface.closest_points,
            {"points": points, "max_distance": 9.0, "tolerance": 0.1},
        ),
        ("Isosurface.contains", surface.contains, {"points": points}),
        *(
            (f"Isosurface.{name}", getattr(surface, name), {"order": 3, "progress": None})
            for name in ("enclosed_volume", "area", "mean_curvature", "gaussian_curvature")
        ),
        ("Isosurface.components", surface.components, {"measured": True, "order": 3, "progress": None}),
        ("Isosurface.sample_points", surface.sample_points, {"count": 5, "seed": 1}),
        ("Isosurface.thickness", surface.thickness, {"points": points, "method": "ray"}),
        ("Isosurface.to_mask", surface.to_mask, {"whole_cells": True, "progress": None}),
        (
            "Isosurface.to_mesh",
            surface.to_mesh,
            {"tolerance": 0.5, "faces": None, "return_distance": True, "return_report": False, "progress": None},
        ),
        (
            "Isosurface.write",
            surface.write,
            {"path": folder / "a.stl", "tolerance": None, "faces": None, "for_print": True, "progress": None},
        ),
        ("Isosurface.mesh_parts", surface.mesh_parts, {"cells": 1000, "progress": None}),
        ("Isosurface.to_print_mesh", surface.to_print_mesh, {"tolerance": 0.5, "faces": None, "progress": None}),
        ("Measurement", iso.Measurement, {"value": 1.0, "error": 0.1}),
        (
            "Isosurface.signed_distance",
            surface.signed_distance,
            {"points": points, "max_distance": 9.0, "tolerance": 0.1},
        ),
        ("Isosurface.with_level", surface.with_level, {"level": 0.01, "progress": None}),
        ("Isosurface.level", lambda level: setattr(iso.Isosurface(o["volume"], 0.0), "level", level), {"level": 0.01}),
        (
            "Material",
            iso.Material,
            {"color": 0.5, "metallic": 0.5, "roughness": 0.5, "specular": 0.5, "cap_color": None},
        ),
        ("Material.evaluate", o["material"].evaluate, {"to_viewer": (0, 0, 1), "to_light": (0, 0.1, 1)}),
        (
            "Mesh",
            iso.Mesh,
            {"vertices": np.eye(3), "faces": [(0, 1, 2)], "normals": np.eye(3), "colors": np.eye(3), "material": None},
        ),
        *((f"Mesh.{name}", getattr(o["mesh"], name), {}) for name in ("to_meshio", "to_pyvista", "to_trimesh")),
        *(
            (f"{name}.save", o[key].save, {"path": folder / f"{name}.png", "size": (4, 4), "samples": 1})
            for name, key in {"Scene": "scene", "Isosurface": "surface", "Mesh": "mesh", "VolumeData": "data"}.items()
        ),
        ("Volume.save", o["volume"].save, {"path": folder / "v.png", "level": 0.0, "size": (4, 4)}),
        ("Mesh.export", o["mesh"].export, {"path": folder / "a.stl"}),
        *(
            (f"{name}.{method}", getattr(o[key], method), {})
            for name, key in {"Isosurface": "surface", "Volume": "volume", "VolumeData": "data", "Mesh": "mesh"}.items()
            for method in ("to_pyvista", "GetClassName", "to_trimesh")
            if hasattr(o[key], method) and (name, method) not in (("Mesh", "to_pyvista"), ("Mesh", "to_trimesh"))
        ),
        ("Measurement.replace", iso.Measurement(1.0, 0.1).replace, {"value": 2.0}),
        ("Mesh.write", o["mesh"].write, {"path": folder / "a.ply", "unit": "mm"}),
        *(
            (f"{of.__name__}.{name}", lambda value, function=getattr(of, name): function(value), {"value": None})
            for of in (iso.Mesh, iso.Volume)
            for name in dir(of)
            if name.startswith("from_")
        ),
        ("OrthographicCamera", iso.OrthographicCamera, {**look, "height": 2.0}),
        (
            "OrthographicCamera.from_pyvista",
            iso.OrthographicCamera.from_pyvista,
            {"camera_position": o["position"], "parallel_scale": 1.0},
        ),
        ("OrthographicCamera.to_pyvista", o["flat_camera"].to_pyvista, {}),
        ("PerspectiveCamera.to_pyvista", o["camera"].to_pyvista, {}),
        (
            "PerspectiveCamera.from_pyvista",
            iso.PerspectiveCamera.from_pyvista,
            {"camera_position": o["position"], "view_angle": 30.0},
        ),
        ("PerspectiveCamera", iso.PerspectiveCamera, {**look, "field_of_view": 30.0, "field_of_view_axis": "vertical"}),
        ("PerspectiveCamera.with_lens", o["camera"].with_lens, {"aperture_radius": 0.1, "focus_distance": 3.0}),
        ("PanoramicCamera", iso.PanoramicCamera, look),
        (
            "open_volume",
            iso.open_volume,
            {"path": folder / "store.zarr", "memory_limit": "64MB", "scale": 0},
        ),
        (
            "scale_for",
            iso.scale_for,
            {"store": folder / "store.zarr", "camera": o["camera"], "size": (32, 24)},
        ),
        (
            "convert",
            iso.convert,
            {
                "source": samples,
                "out": folder / "a.zarr",
                "degree": 2,
                "boundary": "mirror",
                "filter": "interpolate",
                "smoothing": 0.0,
                "spacing": 1.0,
                "origin": (0, 0, 0),
                "direction": np.eye(3),
                "axes": "zyx",
                "chunk": 16,
                "memory_limit": "8GB",
                "workers": 1,
                "client": None,
                "overwrite": True,
                "progress": None,
            },
        ),
        (
            "ProjectionPlaneCamera",
            iso.ProjectionPlaneCamera,
            {"eye": (0, -5, 0), "right": (1, 0, 0), "down": (0, 0, -1), "center": (0, -4, 0)},
        ),
        (
            "ProjectionPlaneCamera.from_opencv",
            iso.ProjectionPlaneCamera.from_opencv,
            {
                "intrinsics": [(9, 0, 2), (0, 9, 2), (0, 0, 1)],
                "rotation": np.eye(3),
                "translation": (0, 0, 5),
                "size": size,
                "pixel_center": 0.5,
                "distortion": (0, 0, 0, 0),
            },
        ),
        *(
            (f"{type(o[name]).__name__}.{method}", getattr(o[name], method), {"size": size})
            for name in ("camera", "plane_camera", "flat_camera", "panorama")
            for method in ("rays", "world_to_ndc", "to_opencv")
            if hasattr(o[name], method)
        ),
        (
            "Outline",
            iso.Outline,
            {
                "exponent": 2.0,
                "color": 1.0,
                "surface_color": 0.0,
                "opacity": 1.0,
                "silhouette_opacity": 1.0,
                "silhouette_exponent": 2.0,
                "cap_color": None,
            },
        ),
        (
            "PathTracer",
            iso.PathTracer,
            {
                "material": o["material"],
                "materials": {0: o["material"]},
                "lights": [iso.SphereLight((0, 0, 3), 1.0)],
                "max_bounces": 2,
                "seed": 1,
            },
        ),
        (
            "Phong",
            iso.Phong,
            {
                "color": 1.0,
                "ambient": 0.1,
                "diffuse": 0.5,
                "specular": 0.1,
                "specular_exponent": 9.0,
                "ambient_light": 1.0,
                "lights": [iso.PositionalLight((0, 0, 3))],
                "two_sided": True,
                "shadows": True,
                "shadow_samples": 2,
                "opacity": 1.0,
                "silhouette_opacity": 1.0,
                "silhouette_exponent": 2.0,
                "cap_color": None,
            },
        ),
        ("PositionalLight", iso.PositionalLight, {"position": (0, 0, 3), "intensity": 1.0}),
        (
            "ProgressiveRenderer",
            iso.ProgressiveRenderer,
            {"scene": scene, "camera": o["camera"], **picture, "light": iso.PathTracer()},
        ),
        ("ProgressiveRenderer.step", o["progressive"].step, {"samples": 1, "progress": None}),
        ("ProgressiveRenderer.reset", o["progressive"].reset, {"camera": o["camera"]}),
        (
            "ProgressiveRenderer.run",
            o["progressive"].run,
            {"samples": 2, "noise": 1.0, "time_limit": 0.1, "checkpoint": folder / "b.checkpoint", "progress": None},
        ),
        ("ProgressiveRenderer.save_checkpoint", o["progressive"].save_checkpoint, {"path": folder / "b.checkpoint"}),
        (
            "ProgressiveRenderer.load_checkpoint",
            _loaded(o["progressive"], folder / "a.checkpoint"),
            {"path": folder / "a.checkpoint", "progress": None},
        ),
        ("RayMeshIntersector", iso.RayMeshIntersector, {"geometry": o["surface"]}),
        *(
            (f"RayMeshIntersector.{name}", getattr(o["intersector"], name), dict(ray))
            for name in ("intersects_any", "intersects_first", "intersects_id", "intersects_location")
        ),
        ("RayMeshIntersector.contains_points", o["intersector"].contains_points, {"points": points}),
        (
            "RectangleLight",
            iso.RectangleLight,
            {"corner": (0, 0, 3), "edge_u": (1, 0, 0), "edge_v": (0, 1, 0), "radiance": 1.0},
        ),
        ("Scene", iso.Scene, {"objects": [o["mesh"]], "build_quality": "medium"}),
        (
            "research.isosurface",
            iso.research.isosurface,
            {"volume": o["volume"], "level": 0.0, "method": "exact", "prune_depth": 1, "prune_border": True},
        ),
        (
            "Scene.add",
            lambda **given: iso.Scene().add(**given),
            {"obj": o["mesh"], "transform": np.eye(4), "visible": True, "casts_shadow": True},
        ),
        (
            "Scene.cast_rays",
            scene.cast_rays,
            {"rays": o["rays"], **near, "coherent": True, "outputs": ("t_hit",), "dtype": "float32", "out": {}},
        ),
        ("Scene.extent", scene.extent, {"directions": points}),
        ("Scene.count_intersections", scene.count_intersections, {"rays": o["rays"], **near}),
        ("Scene.list_intersections", scene.list_intersections, {"rays": o["rays"], **near}),
        ("Scene.settle", scene.settle, {"progress": None}),
        ("Scene.test_occlusions", scene.test_occlusions, {"rays": o["rays"], **near, "coherent": True}),
        ("Scene.closest_points", scene.closest_points, {"points": points, "max_distance": 9.0, "tolerance": 0.1}),
        ("Scene.signed_distance", scene.signed_distance, {"points": points, "max_distance": 9.0, "tolerance": 0.1}),
        ("Scene.occupancy", scene.occupancy, {"points": points}),
        *(
            (f"Scene.{name}", getattr(scene, name), {"query_points": points})
            for name in ("compute_closest_points", "compute_distance", "compute_signed_distance", "compute_occupancy")
        ),
        ("Scene.object", scene.object, {"geometry_id": 0}),
        ("Scene.transform", scene.transform, {"geometry_id": 0}),
        ("Scene.visibility", scene.visibility, {"geometry_id": 0}),
        ("Scene.remove", lambda geometry_id: iso.Scene([o["mesh"]]).remove(geometry_id), {"geometry_id": 0}),
        (
            "Scene.set_transform",
            lambda **given: iso.Scene([o["mesh"]]).set_transform(**given),
            {"geometry_id": 0, "transform": np.eye(4)},
        ),
        (
            "Scene.set_visibility",
            lambda **given: iso.Scene([o["mesh"]]).set_visibility(**given),
            {"geometry_id": 0, "visible": True, "casts_shadow": False},
        ),
        (
            "Scene.certificate",
            scene.certificate,
            {"ray": o["rays"][0], "t_near": 0.0, "t_far": 9.0, "geometry_id": 0},
        ),
        (
            "Scene.secondary_rays",
            scene.secondary_rays,
            {"rays": o["rays"], "hits": dict(o["hits"]), "directions": -o["rays"][:, 3:]},
        ),
        ("SphereLight", iso.SphereLight, {"center": (0, 0, 3), "radius": 1.0, "radiance": 1.0}),
        (
            "SurfaceDistance",
            iso.SurfaceDistance,
            {
                "mean": iso.Measurement(1.0, 0.1),
                "rms": iso.Measurement(1.0, 0.1),
                "maximum": (1.0, 2.0),
                "points": np.zeros((1, 3)),
                "distances": np.zeros(1),
            },
        ),
        (
            "surface_distance",
            iso.surface_distance,
            {"surface": surface, "other": surface, "samples": 5, "seed": 1, "tolerance": 1.0},
        ),
        (
            "measure",
            iso.measure,
            {"volume": surface, "levels": [-0.1, 0.0], "tolerance": 0.1, "order": None},
        ),
        ("hausdorff_distance", iso.hausdorff_distance, {"surface": surface, "other": surface, "tolerance": 1.0}),
        (
            "Volume",
            iso.Volume,
            {
                "data": samples,
                "spacing": (1, 1, 2),
                "origin": (0, 0, 0),
                "direction": np.eye(3),
                "degree": 2,
                "boundary": "mirror",
                "filter": "smoothing",
                "smoothing": 0.1,
                "axes": "zyx",
                "progress": None,
            },
        ),
        ("Volume.adjoint", o["volume"].adjoint, {"indices": np.arange(6), "weights": np.ones(6)}),
        ("Volume.cell_at", o["volume"].cell_at, {"primitive_ids": np.arange(3)}),
        ("Volume.coefficient_weights", o["volume"].coefficient_weights, {"points": points}),
        ("Volume.primitive_id", o["volume"].primitive_id, {"cells": np.zeros((3, 3), int)}),
        ("Volume.sample", o["volume"].sample, {"points": points, "derivative": 1}),
        ("VolumeData", lambda **given: iso.VolumeData(**given).to_volume(), {"data": samples, "spacing": (1, 1, 2)}),
        ("VolumeData.from_affine", iso.VolumeData.from_affine, {"data": samples, "affine": np.eye(4)}),
        ("VolumeData.position", o["data"].position, {"index": points}),
        ("VolumeData.replace", o["data"].replace, {"spacing": (1, 1, 1)}),
        ("VolumeData.to_volume", o["data"].to_volume, {"degree": 2}),
        (
            "Labels",
            iso.Labels,
            {
                "data": np.eye(4, dtype=np.uint8)[None],
                "spacing": (1, 1, 2),
                "origin": (0, 0, 0),
                "direction": np.eye(3),
                "names": {1: "one"},
                "colors": {1: "red"},
                "background": 0,
            },
        ),
        ("Labels.read", iso.Labels.read, {"path": folder / "a.npy", "names": {1: "one"}, "background": 0}),
        ("Labels.mask", o["labels"].mask, {"label": 1}),
        ("Labels.surface", o["labels"].surface, {"label": "left", "smoothing": 1.5}),
        ("Labels.surfaces", o["labels"].surfaces, {"labels": [1], "smoothing": 1.5}),
        ("Labels.scene", o["labels"].scene, {"labels": [1], "smoothing": 1.5}),
        ("Labels.measure", o["labels"].measure, {"labels": [1], "smoothing": 1.5}),
        ("Labels.compare", o["labels"].compare, {"other": o["labels"], "labels": [1], "by": "name", "smoothing": 1.5}),
        ("Labels.table", o["labels"].table, {}),
        ("Labels.show", lambda **given: o["labels"].show(browser=False, **given).close(), {"height": 480}),
        ("research.VoxelHopper", iso.research.VoxelHopper, {"surface": surface, "strides": True}),
        (
            "VoxelHopper.cast_rays",
            o["hopper"].cast_rays,
            {"rays": o["rays"], **near, "outputs": ("positions",), "dtype": "float32"},
        ),
        ("camera_for", iso.camera_for, {"scene": scene, **frame}),
        ("ground_for", iso.ground_for, {"scene": scene, "up": (0, 0, 1), "reach": 2.0}),
        ("turntable_cameras", iso.turntable_cameras, {"scene": scene, "count": 3, **frame}),
        (
            "turntable",
            iso.turntable,
            {
                "scene": scene,
                "path": folder / "turn-#.png",
                "frames": 1,
                "fps": 10.0,
                "quality": 5.0,
                "level": None,
                **frame,
                "margin": 0.1,
                "size": (4, 2),
                "light": iso.Phong(),
                "color": None,
                "opacity": None,
                "background": 0.5,
                "samples": 1,
                "annotate": ("scale_bar",),
                "unit": "mm",
                "progress": None,
            },
        ),
        (
            "animate",
            iso.animate,
            {"function": lambda t: o["image"], "path": folder / "frame-#.png", "frames": 1, "fps": 2.0},
        ),
        ("read_environment", iso.read_environment, {"path": folder / "sky.hdr"}),
        (
            "read_volume",
            iso.read_volume,
            {
                "path": folder / "a.raw",
                "shape": (3, 4, 5),
                "dtype": "f8",
                "offset": 0,
                "spacing": (1, 1, 1),
                "origin": (0, 0, 0),
                "direction": np.eye(3),
                "name": None,
            },
        ),
        (
            "render",
            iso.render,
            {
                "scene": scene,
                "camera": o["camera"],
                **picture,
                "light": iso.Phong(),
                "level": None,
                "color": None,
                "opacity": None,
                "samples": 1,
                "crop": None,
                "annotate": ("scale_bar",),
                "unit": "mm",
                "progress": None,
            },
        ),
        (
            "render, a crop",
            iso.render,
            {"scene": scene, "camera": o["camera"], "size": (4, 3), "crop": (1, 0, 2, 2), "samples": 2},
        ),
        (
            "Studio",
            iso.Studio,
            {"key": 1.0, "fill": 0.3, "sky": 0.5, "ground": True, "up": (0, 0, 1), "light_samples": 2, "fast": False},
        ),
        ("Studio.replace", iso.Studio().replace, {"key": 2.0}),
        (
            "render_progressive",
            lambda **given: list(itertools.islice(iso.render_progressive(**given), 2)),
            {"scene": scene, "camera": o["camera"], "samples": 2, "size": (4, 3)},
        ),
        ("ridges_and_valleys", iso.ridges_and_valleys, {"curvature": 0.5, "color": 0.5, "ridge": 1.0, "valley": 0.0}),
        ("set_thread_count", iso.set_thread_count, {"count": 2}),
        ("thread_count", iso.thread_count, {}),
        ("suggest_levels", iso.suggest_levels, {"data": samples, "count": 2}),
        ("suggest_mask", iso.suggest_mask, {"volume": o["volume"]}),
        ("suggest_view", iso.suggest_view, {"volume": o["volume"]}),
        ("Image.to_srgb", o["image"].to_srgb, {}),
        ("Image.tone_map", o["image"].tone_map, {"curve": "neutral", "exposure": 1.0}),
        ("Image.over", o["image"].over, {"background": 0.5}),
        ("Image.write", o["image"].write, {"path": folder / "a.exr", "half": False, "quality": 90}),
        (
            "view",
            lambda item, **given: iso.view(item, browser=False, **given).close(),
            {
                "item": surface,
                "levels": [0.1],
                "host": "127.0.0.1",
                "port": 0,
                "token": "secret",
                "session": None,
                "height": 300,
                "upload_limit": "1GB",
                "upload_count": 3,
            },
        ),
        *(
            (
                f"{name.title()}.show",
                lambda item=o[name], **given: item.show(browser=False, **given).close(),
                {"levels": [0.1]},
            )
            for name in ("scene", "volume")
        ),
        *(
            (f"{name}.show", lambda item=o[key], **given: item.show(browser=False, **given).close(), {"height": 480})
            for name, key in {"Mesh": "mesh", "VolumeData": "data"}.items()
        ),
        ("Isosurface.show", lambda **given: surface.show(browser=False, **given).close(), {"levels": [0.1]}),
        (
            "write_video",
            iso.write_video,
            {"path": folder / "a.mp4", "images": [o["image"]], "fps": 30.0, "quality": 5.0},
        ),
        *(
            (f"volumes.{name}", getattr(volumes, name), _defaults(getattr(volumes, name)))
            for name in volumes.__all__
            if name != "Field"
        ),
        ("volumes.Field", lambda **given: volumes.torus().values(**given), {"shape": (3, 4, 5), "dtype": "f4"}),
    ]
    values = {kind.__name__ for kind in value_types()}
    made = [(name, function(**given), given) for name, function, given in table if name in values]
    return [*table, *((f"{name}.replace", value.replace, given) for name, value, given in made)]


def _loaded(renderer, path):
    """The renderer's `load_checkpoint`, with a file for it."""
    renderer.save_checkpoint(path)
    return renderer.load_checkpoint


def _defaults(function):
    return {name: parameter.default for name, parameter in inspect.signature(function).parameters.items()}


def public_names():
    """The names of all public callables."""
    names = set()
    for name in iso.__all__:
        value = getattr(iso, name)
        if not callable(value):
            continue
        names.add(name)
        for member in dir(value) if inspect.isclass(value) and name not in LEFT_OUT else ():
            static = inspect.getattr_static(value, member)
            if member.startswith("_") or not callable(getattr(value, member)) or isinstance(static, property):
                continue
            if not (issubclass(value, dict) and hasattr(dict, member)):
                names.add(f"{name}.{member}")
    return names - LEFT_OUT
