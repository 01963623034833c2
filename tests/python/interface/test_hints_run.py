"""Each hint for a name of another library runs as a user would call it, with values for what it leaves open."""

import inspect
import math
import re
import sys
from pathlib import Path

import numpy as np
import PIL.Image
import pytest

import isospline
from isospline import volumes
from isospline.base import foreign, mistakes

sys.path.insert(0, str(Path(__file__).parents[2]))
from fuzz import call_table

pytest.importorskip("zarr")  # some of the hints are about stores

pytestmark = pytest.mark.filterwarnings("ignore:light")
NAMES, KEYWORDS = foreign.tables()["names"], foreign.tables()["keywords"]

# Hints with words between the calls, as calls.
IN_WORDS = {
    "render(scene, camera) for pictures or view(scene) for the viewer": ["render(scene, camera)", "view(scene)"],
    "surface.to_mesh() of each object": ["[scene.object(id).to_mesh() for id in scene.ids[:1]]"],
    "surface.level of an object": ["scene.object(0).level"],
    "ColorByCurvature(kind, limits=...) or mean_curvature(), its integral": [
        "ColorByCurvature(kind, limits=...)",
        "surface.mean_curvature()",
    ],
    "Isosurface.thickness(points), of isosurfaces alone": ["surface.thickness(points)"],
    "shape, in the order of the array's axes": ["owner.shape"],
    "numpy.asarray(image).shape or size, (width, height)": ["numpy.asarray(image).shape", "image.size"],
    "Scene(mesh).closest_points(points) or .signed_distance(points)": [
        "Scene(mesh).closest_points(points)",
        "Scene(mesh).signed_distance(points)",
    ],
    "legend=True, with Isosurface(..., name=...)": ["render(Isosurface(volume, level, name='a'), legend=True)"],
    "name, or Labels(data).surface(label)": ["call(name='bone')", "Labels(numbers).surface(label)"],
    "Labels(data).surfaces(labels)": ["Labels(numbers).surfaces(labels)"],
    "scale, or Isosurface(open_volume(path), level)": ["call(scale=0)", "Isosurface(open_volume(store), level)"],
    "convert(data, path)": ["convert(data, out, overwrite=True)"],
    "convert(VolumeData.from_affine(array, affine), path)": [
        "convert(VolumeData.from_affine(array, affine), out, overwrite=True)"
    ],
    "write_video(path, images)": ["write_video(video, images)"],
    "turntable(scene, path)": ["turntable(scene, video, frames=1, size=size)"],
    "animate(function, path)": ["animate(function, video, frames=1)"],
    "frames, or turntable_cameras(scene, count)": ["call(frames=1)", "turntable_cameras(scene, count)"],
    "read_volume(path) or read_mesh(path)": ["read_volume(path)", "read_mesh(stl)"],
    "read_mesh(path)": ["read_mesh(stl)"],
    "image.save(path) or mesh.save(path)": ["image.save(png)", "mesh.save(stl)"],
    "save(path)": ["image.save(png)"],
    "render(...).save(path)": ["render(scene).save(png)"],
    "Isosurface(data, level)": ["Isosurface(data, level)"],
    "render(surfaces, legend=True)": ["render(surfaces, legend=True)"],
    "Labels(VolumeData.from_affine(array, affine))": ["Labels(VolumeData.from_affine(numbers, affine))"],
    # Methods that begin with the same words as a call.
    "Isosurface(volume, level, largest=1) or components()": [
        "Isosurface(volume, level, largest=1)",
        "surface.components()",
    ],
    "PIL.Image.fromarray(numpy.asarray(image))": ["PIL.Image.fromarray(numpy.asarray(image))"],
}
# Values for three dots after a keyword.
VALUES = {
    "faces": "200",
    "size": "(8, 6)",
    "spacing": "(1, 1, 2)",
    "origin": "(0, 0, 0)",
    "degree": "2",
    "color": "'red'",
    "opacity": "0.5",
    "smoothing": "0.2",
    "limits": "(-1, 1)",
    "samples": "2",
    "level": "level",
    "material": "Material()",
    "materials": "{0: Material()}",
    "background": "'white'",
    "view": "'front'",
    "method": "'exact'",
    "prune_depth": "1",
    "name": "'a'",
}
# Parameters without which calls are not complete.
NEEDED = ("function", "frames", "scene", "volume", "level", "vertices", "faces", "count", "data", "direction", "path")
NEEDED += ("shape", "dtype")
# Values for parameters of calls that have none in the table of calls.
FOR_PARAMETERS = {
    "color": "red",
    "opacity": 0.5,
    "samples": 1,
    "level": 0.1,
    "smoothing": 0.2,
    "unit": "mm",
    "name": "bone",
    "values": [1, 2, 3],
    "size": (6, 4),
    "path": None,
    "background": 1.0,
    "progress": None,
}


@pytest.fixture(scope="module")
def world(tmp_path_factory):
    """What hints name: objects, files and numbers."""
    folder = tmp_path_factory.mktemp("hints")
    made = call_table.objects()
    call_table.write_files(folder)
    calls = call_table.calls(made, folder)
    surface, image = made["surface"], made["image"]
    numbers = np.zeros((8, 8, 8), np.uint8)
    numbers[2:6, 2:6, 2:4], numbers[2:6, 2:6, 4:6] = 1, 2
    mesh = surface.to_mesh()
    mesh.write(folder / "mesh.stl")
    named = isospline.Isosurface(made["volume"], 0.0, name="bone")
    wide = np.tile(np.linspace(0, 1, 12), (12, 12, 1))
    names = {name: getattr(isospline, name) for name in isospline.__all__}
    names["render"] = lambda *args, **given: isospline.render(*args, **{"size": (8, 6), **given})
    names |= {
        "numpy": np,
        "PIL": PIL,
        "math": math,
        "research": isospline.research,
        "volumes": volumes,
        "scene": isospline.Scene(surface),
        "surface": surface,
        "other": surface,
        "surfaces": [named],
        "mesh": mesh,
        "volume": made["volume"],
        "data": made["data"],
        "array": wide,
        "image": image,
        "images": [image],
        "function": lambda t: image,
        "camera": made["camera"],
        "store": folder / "store.zarr",
        "path": folder / "a.npy",
        "out": folder / "o.zarr",
        "stl": folder / "mesh.stl",
        "png": folder / "a.png",
        "video": folder / "a.mp4",
        "numbers": numbers,
        "vertices": mesh.vertices,
        "faces": mesh.faces,
        "level": 0.01,
        "count": 2,
        "size": (8, 6),
        "index": 0,
        "points": [(0.1, 0.2, 0.3)],
        "point": (0, 0, 0),
        "normal": (0, 0, 1),
        "eye": (0, -5, 0),
        "target": (0, 0, 0),
        "origins": [(0, -3, 0.2)],
        "directions": [(0, 1, 0)],
        "direction": (0, 0, 1),
        "position": (0, 0, 3),
        "objects": [surface],
        "shape": 9,
        "matrix": np.eye(4),
        "affine": np.diag((1, 2, 3, 1)),
        "geometry_id": 0,
        "cmap": "viridis",
        "kind": "mean",
        "intrinsics": np.diag((9, 9, 1)),
        "rotation": np.eye(3),
        "translation": (0, 0, 5),
        "tolerance": 0.1,
        "camera_position": made["position"],
        "volume_of_the_box": 8.0,
        "radius": 0.7,
        "label": 1,
        "labels": [1, 2],
        "yfov": 0.5,
        "vmin": 0.0,
        "vmax": 1.0,
        "width": 8,
        "height": 6,
        "max_depth": 4,
        "reduction": 0.5,
    }
    owners = {"Isosurface": surface, "Volume": made["volume"], "VolumeData": made["data"], "Mesh": mesh}
    owners["SurfaceDistance"] = isospline.surface_distance(surface, mesh, samples=10)
    owners |= {"Scene": names["scene"], "Image": image, "PerspectiveCamera": made["camera"], "isospline": isospline}
    view = lambda *items: isospline.view(*items, browser=False).close() or True  # noqa: E731
    return {"names": {**names, "view": view}, "owners": owners, "calls": {name: rest for name, *rest in calls}}


def expressions(meaning):
    """The calls of a hint."""
    parts = IN_WORDS.get(meaning) or re.split(r" or | and ", meaning)
    for part in parts:
        part = re.sub(r"(\w+)=\.\.\.", lambda match: f"{match[1]}={VALUES[match[1]]}", part)
        part = part.replace("lights=[...]", "lights=[DirectionalLight(direction)]").replace("Phong(...)", "Phong()")
        yield part.replace("PathTracer(...)", "PathTracer()").replace("render(...,", "render(scene,")


@pytest.fixture(autouse=True)
def in_a_folder(tmp_path, monkeypatch):
    """Hints name files, and change the number of threads."""
    monkeypatch.chdir(tmp_path)
    threads = isospline.thread_count()
    yield
    isospline.set_thread_count(threads)


def run(text, names, owner=None):
    first = re.match(r"\w*", text)[0]
    if owner is not None and first and hasattr(owner, first) and first not in isospline.__all__:
        text = f"owner.{text}"
    if re.fullmatch(r"surface\.level = level", text):
        names["surface"].level = names["surface"].level
        return names["surface"]
    return eval(text, {**names, "owner": owner})


NAME_ROWS = [(owner, meaning) for owner, table in NAMES.items() for meaning in table.values()]


@pytest.mark.parametrize(("owner", "meaning"), NAME_ROWS, ids=lambda value: str(value)[:60])
def test_what_is_meant_by_a_name_runs(world, owner, meaning):
    for text in expressions(meaning):
        run(text, world["names"], world["owners"][owner])


KEYWORD_ROWS = [
    (call, meaning) for call, table in KEYWORDS.items() if call != "any" for meaning in dict.fromkeys(table.values())
]


@pytest.mark.parametrize(("call", "meaning"), KEYWORD_ROWS, ids=lambda value: str(value)[:60])
def test_what_is_meant_by_a_keyword_runs(world, call, meaning):
    function, arguments = world["calls"][call]
    for text in expressions(meaning):
        small = ("size",) if call in ("render", "turntable") else ()
        needed = {name: value for name, value in arguments.items() if name in (*NEEDED, *small)}
        names = {**world["names"], "call": lambda **given: function(**{**needed, **given})}
        if re.fullmatch(r"\w+", text):
            names["value"] = arguments.get(text, FOR_PARAMETERS.get(text))
            text = f"{text}=value"
        run(f"call({text})" if re.match(r"\w+=(?!=)", text) else text, names)


def calls_with(parameter):
    """The public callables with a parameter."""
    for name in sorted(call_table.public_names()):
        function = isospline
        for part in name.split("."):
            function = getattr(function, part)
        if name != "SurfaceDistance" and parameter in inspect.signature(function).parameters:
            yield name, function


ANY_ROWS = [(keyword, meaning) for keywords, meaning in KEYWORDS["any"].items() for keyword in keywords.split(", ")]


@pytest.mark.parametrize(("keyword", "meaning"), ANY_ROWS)
def test_what_is_meant_by_a_keyword_of_any_call_runs(world, keyword, meaning):
    """In all public calls that have the parameter, with the value of the foreign keyword."""
    found = [*calls_with(foreign.parameter_of(meaning))]
    assert found
    for name, function in found:
        if keyword in inspect.signature(function).parameters or keyword in own_keywords(name):
            continue
        if all(each.kind is not each.VAR_KEYWORD for each in inspect.signature(function).parameters.values()):
            hint = rf"^{keyword}: .* an unknown keyword; did you mean {re.escape(meaning)}\?$"
            with pytest.raises(TypeError, match=hint):
                function(**{keyword: 1})
        call, arguments = world["calls"].get(name, (None, {}))
        if call is None or name in ("convert", "ProgressiveRenderer.load_checkpoint"):
            continue
        parameter, _, value = meaning.partition("=")
        arguments = {each: given for each, given in arguments.items() if each != "material" or parameter != "opacity"}
        if value:
            arguments[parameter] = eval(value, world["names"])
        elif parameter not in arguments:
            arguments[parameter] = FOR_PARAMETERS[parameter]
        call(**arguments)


def own_keywords(call):
    return {name for names in KEYWORDS.get(call, {}) for name in names.split(", ")}


def test_hints_mean_what_the_foreign_names_mean(world):
    names = world["names"]
    surface, mesh, volume = names["surface"], names["mesh"], names["volume"]
    trimesh_mesh = pytest.importorskip("trimesh").Trimesh(mesh.vertices, mesh.faces)
    assert run("to_trimesh().area", names, mesh) == pytest.approx(trimesh_mesh.area)
    assert run("max(mesh.to_trimesh().split(), key=lambda part: part.volume)", names).is_watertight
    assert run("numpy.asarray(image).shape", names)[1::-1] == names["image"].size
    assert run("volumes.sphere(radius).volume(shape)", names).shape == (9, 9, 9)
    data = isospline.VolumeData.from_affine(names["array"], names["affine"])
    np.testing.assert_array_equal(data.to_volume().spacing, np.diag(names["affine"])[:3])
    assert isospline.PerspectiveCamera((0, -5, 0), (0, 0, 0), field_of_view=math.degrees(0.5)).field_of_view == (
        pytest.approx(math.degrees(0.5))
    )
    assert isospline.Isosurface(surface.volume, 0.02).volume is volume
    colored = isospline.ColorByVolume(isospline.Volume(names["array"]), limits=(0.0, 1.0))
    assert tuple(colored.limits) == (0.0, 1.0)


def test_values_for_parameters_run(world, tmp_path):
    """Each line of the table of values, in each public call with the parameter that raises it."""
    n = world["names"]
    fixed = {"path": n["path"], "data": n["data"], "image": None}
    for parameter, kind, _, meaning in mistakes._MEANINGS:
        if kind.partition(".")[0] in ("SimpleITK", "nibabel", "vtkmodules", "pyvista") or "the images" in meaning:
            continue  # tests/python/interop converts images
        text = re.sub(r"(\w+)=\.\.\.", lambda match: f"{match[1]}={VALUES[match[1]]}", meaning.partition(", with")[0])
        if parameter == "function":
            (text,) = expressions(meaning)
        value = eval(text, {**n, **fixed, "other": n["volume"]})
        for name, call in {
            "scene": lambda value: isospline.ground_for(value),
            "material": lambda value: isospline.PathTracer(value),
            "camera": lambda value: isospline.render(n["scene"], value, size=(4, 3), light="phong"),
            "volume": lambda value: isospline.Isosurface(value, 0.1),
            "data": lambda value: isospline.suggest_levels(value),
        }.items():
            if name == parameter and not isinstance(value, (isospline.ColorByVolume, isospline.Volume)):
                call(value)
