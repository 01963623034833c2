"""Mistakes of new users: one sentence with the parameter, the expected and the given value, and a suggestion."""

import inspect
import pydoc
import re
import traceback

import numpy as np
import pytest

import isospline
from isospline import volumes
from isospline.base.mistakes import described


@pytest.fixture(scope="module")
def volume():
    field = volumes.sphere(0.7)
    return field.volume(12)


@pytest.fixture(scope="module")
def surface(volume):
    return isospline.Isosurface(volume, 0.0)


@pytest.fixture(scope="module")
def scene(surface):
    return isospline.Scene([surface])


@pytest.fixture(scope="module")
def camera(scene):
    return isospline.camera_for(scene)


ARRAY = np.arange(12.0).reshape(3, 4)
LIGHT = isospline.PositionalLight((0, 0, 3))

# The call, the beginning of the message, and the suggestion.
MISTAKES = {
    "a dict in place of a scene": (
        lambda s: isospline.ProgressiveRenderer({"a": s.scene}, s.camera),
        "scene: expected a Scene, an Isosurface, a Mesh, a list of them, a Volume, an array or a file, got",
        None,
    ),
    "one number for a size": (
        lambda s: isospline.render(s.scene, s.camera, size=128, light="phong"),
        "size: expected two whole numbers, got 128",
        "(128, 128)",
    ),
    "a material as light": (
        lambda s: isospline.render(s.scene, s.camera, light=isospline.Material("red")),
        "light: expected a Studio, a Phong, ",
        "light=PathTracer(material)",
    ),
    "a lone lamp as light": (
        lambda s: isospline.render(s.scene, s.camera, light=LIGHT),
        "light: expected a Studio, a Phong, ",
        "light=Phong(lights=[PositionalLight(...)])",
    ),
    "a shading in place of a path tracer": (
        lambda s: isospline.ProgressiveRenderer(s.scene, s.camera, light=isospline.Phong()),
        "light: expected a PathTracer, got Phong",
        None,
    ),
    "the shading of earlier versions": (
        lambda s: isospline.render(s.scene, s.camera, shading=isospline.Phong(), light="phong"),
        "shading: unknown keyword of render",
        "light=Phong(...)",
    ),
    "a class in place of an object": (
        lambda s: isospline.render(s.scene, s.camera, light=isospline.Phong),
        "light: expected a Studio, a Phong",
        "Phong(...)",
    ),
    "a lone light": (
        lambda s: isospline.Phong(lights=LIGHT),
        "lights: expected a sequence of PositionalLight or DirectionalLight",
        "[PositionalLight(...)]",
    ),
    "a lone lamp of a path tracer": (
        lambda s: isospline.PathTracer(lights=LIGHT),
        "lights: expected a sequence of",
        "[PositionalLight(...)]",
    ),
    "a misspelt keyword": (
        lambda s: isospline.Phong(colour=1),
        "colour: expected a parameter of Phong (color, ",
        "color",
    ),
    "a misspelt keyword of a Python function": (
        lambda s: isospline.render(s.scene, s.camera, lightt=None, light="phong"),
        "lightt: expected a parameter of render (",
        "light",
    ),
    "a keyword of another library": (
        lambda s: isospline.PerspectiveCamera((0, 0, 1), (0, 0, 0), fov=30),
        "fov: expected a parameter of PerspectiveCamera (",
        "field_of_view",
    ),
    "the isovalue of another library": (
        lambda s: isospline.Isosurface(s.volume, isovalue=0.5),
        "isovalue: expected a parameter of Isosurface (",
        "level",
    ),
    "arrays in a video": (
        lambda s: isospline.write_video("a.mp4", [np.zeros((4, 4, 3))]),
        "images: expected an isospline.Image each, got ndarray of shape (4, 4, 3)",
        "the images that render() returns",
    ),
    "a number by position": (
        lambda s: isospline.camera_for(s.scene, 200),
        "camera_for: expected scene by position and the keywords view, up, ",
        None,
    ),
    "an array for a level": (
        lambda s: isospline.Isosurface(s.volume, ARRAY),
        "level: expected a number, got ndarray of shape (3, 4)",
        None,
    ),
    "text for a level": (lambda s: setattr(s.surface, "level", "0.5"), "level: expected a number, got '0.5'", None),
    "no level": (
        lambda s: isospline.Isosurface(s.volume),
        "level: expected a value for this parameter of Isosurface",
        None,
    ),
    "a real degree": (
        lambda s: isospline.Volume(np.zeros((3, 3, 3)), degree=2.0),
        "degree: expected a whole number, got 2.0",
        None,
    ),
    "text for a flag": (lambda s: isospline.Phong(shadows="no"), "shadows: expected True or False, got 'no'", None),
    "a shading as material": (
        lambda s: isospline.Isosurface(s.volume, 0.0, material=isospline.Phong()),
        "material: expected a Material or None, got Phong",
        "Material(color=...)",
    ),
    "a position as camera": (
        lambda s: isospline.render(s.scene, (0, -5, 0)),
        "camera: expected a PerspectiveCamera, a",
        "PerspectiveCamera(eye, target)",
    ),
    "a dict of names": (
        lambda s: isospline.PathTracer(materials={"skin": isospline.Material()}),
        "materials: expected a dict of objects or geometry ids to Material, got dict of str to Material",
        None,
    ),
    "arrays as rays and limits": (
        lambda s: s.scene.cast_rays(np.zeros((3, 6)), np.zeros(3), np.ones(3)),
        "Scene.cast_rays: expected rays, directions by position and the keywords t_near, ",
        None,
    ),
    "a path as data": (
        lambda s: isospline.Volume("head.nii.gz"),
        "data: expected a three-dimensional array of real numbers, got 'head",
        "read_volume(path).to_volume()",
    ),
    "one limit": (
        lambda s: isospline.ColorByVolume(s.volume, limits=3),
        "limits: expected two numbers, got 3",
        None,
    ),
    "no objects": (lambda s: isospline.Scene(5), "objects: expected isosurfaces and meshes, got 5", None),
    "a scene in a scene": (
        lambda s: isospline.Scene(s.scene),
        "objects: expected isosurfaces and meshes, got Scene",
        None,
    ),
    "a volume in a scene": (
        lambda s: isospline.Scene([s.volume]),
        "objects: expected an Isosurface, a Mesh, or a mesh of",
        None,
    ),
    "a surface to colour by": (
        lambda s: isospline.ColorByVolume(s.surface),
        "volume: expected a Volume, a VolumeData or a three-dimensional array whose values give the colours, got",
        "ColorByVolume(other), with a volume that varies on the surface",
    ),
    "a surface in place of its volume": (
        lambda s: isospline.Isosurface(s.surface, 0.0),
        "volume: expected a Volume, a VolumeData or a three-dimensional array, got Isosurface",
        "surface.volume",
    ),
    "a volume with a place in the world": (
        lambda s: isospline.Volume(isospline.VolumeData(np.zeros((3, 3, 3)), spacing=(1, 1, 2))),
        "data: expected a three-dimensional array of real numbers, got VolumeData",
        "data.to_volume()",
    ),
    "a picture in place of a volume": (
        lambda s: isospline.Volume(isospline.render(s.scene, s.camera, size=(4, 4), light="phong")),
        "data: expected a three-dimensional array of real numbers, got Image",
        None,
    ),
    "a transform beside its object": (
        lambda s: isospline.Scene(s.surface, np.eye(4)),
        "objects: expected an Isosurface, a Mesh, or a mesh of trimesh, PyVista, VTK or meshio, got ndarray",
        "Scene([(surface, matrix)])",
    ),
    "an option of a scene by position": (
        lambda s: isospline.Scene(s.surface, "high"),
        "objects: expected an Isosurface, a Mesh, or a mesh of trimesh, PyVista, VTK or meshio, got 'high'",
        None,
    ),
    "the colour of another library": (
        lambda s: isospline.Material(base_color="red"),
        "base_color: unknown keyword of Material",
        "color",
    ),
    "one number for a size without a camera": (
        lambda s: isospline.render(s.scene, size=128, light="phong"),
        "size: expected two numbers, a width and a height, got 128",
        "(128, 128)",
    ),
    "text for a size": (lambda s: isospline.camera_for(s.scene, size="12"), "size: expected two numbers", None),
    "a fraction as seed": (
        lambda s: isospline.surface_distance(s.surface.to_mesh(), s.surface, seed=1.5),
        "seed: expected a whole number, got 1.5",
        None,
    ),
    "a number in place of a camera": (
        lambda s: isospline.scale_for("a.zarr", 3, (64, 48)),
        "camera: expected a camera of isospline, got 3",
        None,
    ),
    "a number in place of a Plotter": (
        lambda s: isospline.add_to_plotter(3, s.scene),
        "plotter: expected a Plotter of PyVista, got 3",
        None,
    ),
    "text as progress": (
        lambda s: isospline.Volume(np.zeros((3, 3, 3)), progress="bar"),
        "progress: expected a callable, True",
        None,
    ),
}


class Subjects:
    def __init__(self, **subjects):
        self.__dict__.update(subjects)


@pytest.mark.parametrize("mistake", MISTAKES)
def test_mistakes_get_one_sentence(mistake, volume, surface, scene, camera):
    call, beginning, meaning = MISTAKES[mistake]
    with pytest.raises(TypeError) as caught:
        call(Subjects(volume=volume, surface=surface, scene=scene, camera=camera))
    message = str(caught.value)
    assert message.startswith(beginning)
    assert ("; did you mean " in message) == (meaning is not None)
    assert meaning is None or message.partition("; did you mean ")[2].startswith(meaning)
    assert "\n" not in message and "incompatible" not in message and "0x" not in message and "array(" not in message


@pytest.mark.parametrize(
    "call, parameter",
    [
        (lambda s: isospline.surface_distance(s.to_mesh(), s, seed=-1), "seed"),
        (lambda s: isospline.ridges_and_valleys(-1), "curvature"),
        (lambda s: isospline.ridges_and_valleys(float("nan")), "curvature"),
        (lambda s: isospline.set_thread_count(-1), "count"),
        (lambda s: isospline.camera_for(s, size=(0, 2)), "size"),
    ],
)
def test_numbers_out_of_range_name_their_parameter(surface, call, parameter):
    with pytest.raises(ValueError, match=f"^{parameter}: expected"):
        call(surface)


@pytest.mark.parametrize("color", [(255, 0, 0), [0, 128, 255], (11.5, 1, 2)])
def test_colors_of_eight_bits_are_told(color):
    for make in (
        lambda: isospline.Phong(color=color),
        lambda: isospline.Outline(surface_color=color),
        lambda: isospline.AmbientOcclusion(color=color),
        lambda: isospline.Material(color),
    ):
        with pytest.raises(ValueError, match=r"color: expected .*numbers from 0 to 1.* got .*$") as caught:
            make()
        assert ("did you mean" in str(caught.value)) == (max(color) > 12)


def test_integers_that_do_not_fit_the_machine():
    for call in (lambda: isospline.PathTracer(seed=-1), lambda: isospline.PathTracer(max_bounces=2**40)):
        with pytest.raises(ValueError, match="expected a whole number of 32 bits, got"):
            call()


def test_names_of_colors(scene, camera):
    white = isospline.render(scene, camera, size=(9, 6), background="white", light="phong")
    np.testing.assert_array_equal(
        white.color, isospline.render(scene, camera, size=(9, 6), background=1.0, light="phong").color
    )
    assert isospline.Phong(color="red") == isospline.Phong(color=(1, 0, 0))
    np.testing.assert_allclose(isospline.Material("#ff7f00").color, (1, 0.5 * 255 // 1 / 255, 0))
    with pytest.raises(
        ValueError, match="^background: expected .* the name of a colour, such as \"white\".*, got 'wite'"
    ):
        isospline.render(scene, camera, size=(9, 6), background="wite", light="phong")


def test_progress_as_a_bar(scene, camera, capsys):
    isospline.render(scene, camera, size=(64, 48), progress=True, light="phong")
    assert re.search(r"\d+%\|", capsys.readouterr().err)
    isospline.render(scene, camera, size=(64, 48), progress=False, light="phong")
    assert capsys.readouterr().err == ""


def callables():
    for name in isospline.__all__:
        value = getattr(isospline, name)
        if not callable(value):
            continue
        yield name, value
        for member in dir(value) if inspect.isclass(value) else ():
            if not member.startswith("_") and callable(getattr(value, member)):
                yield f"{name}.{member}", getattr(value, member)


@pytest.mark.parametrize("name, value", callables(), ids=lambda value: value if isinstance(value, str) else "")
def test_every_callable_has_a_signature_and_knows_its_keywords(name, value):
    if (
        name == "Cancelled"
        or (inspect.isclass(value) and issubclass(value, dict))
        or getattr(dict, name.rpartition(".")[2], None)
        or name.startswith("Cancelled.")
    ):
        return
    parameters = inspect.signature(value).parameters
    assert "args" not in parameters and "positional" not in parameters
    if any(each.kind is each.VAR_KEYWORD for each in parameters.values()):
        return
    with pytest.raises(
        TypeError, match="^nonsense: expected (a parameter of|no parameter, as) .*, got an unknown keyword"
    ):
        value(nonsense=1)


def test_signatures_have_types_and_defaults():
    signature = inspect.signature(isospline.Scene.cast_rays)
    assert list(signature.parameters)[:3] == ["self", "rays", "directions"]
    assert signature.parameters["rays"].annotation == "ArrayLike"
    assert signature.parameters["t_far"].default == np.inf
    assert inspect.signature(isospline.Volume).parameters["spacing"].default == (1.0, 1.0, 1.0)
    assert inspect.signature(isospline.Scene.occupancy).return_annotation == "NDArray[np.bool_]"


def test_classes_of_objects_have_their_source():
    """What `help` shows is in the file of the class."""
    for kind in (
        isospline.Volume,
        isospline.Isosurface,
        isospline.Mesh,
        isospline.Scene,
        isospline.research.VoxelHopper,
    ):
        source = inspect.getsource(kind)
        assert source.startswith(f"@public\nclass {kind.__name__}(")
        assert all(line.strip() in source for line in kind.__doc__.splitlines())


def test_attributes_have_docstrings():
    missing = [
        f"{name}.{member}"
        for name in isospline.__all__
        for member, value in inspect.getmembers(getattr(isospline, name))
        if not member.startswith("_") and isinstance(value, property)
        if inspect.getdoc(value) in (None, "", inspect.getdoc(type(value)))
    ]
    assert not missing


@pytest.mark.parametrize(
    "value, text",
    [
        (None, "None"),
        (3, "3"),
        ("a" * 50, repr("a" * 37) + "..."),
        (ARRAY, "ndarray of shape (3, 4) and type float64"),
        ([1, 2], "[1, 2]"),
        (list(range(100)), "list of 100 int"),
        ([ARRAY], "list of 1 ndarray"),
        ({}, "an empty dict"),
        ({1: "a"}, "dict of int to str"),
        (int, "the class int"),
        (10**60, "int"),
        (b"ab", "b'ab'"),
    ],
)
def test_values_in_words(value, text):
    assert described(value) == text


class NotTrue:
    def __bool__(self):
        raise RuntimeError("neither")


@pytest.mark.parametrize(
    "call, beginning",
    [
        (
            lambda s: s.scene.cast_rays([(0, 0, 3, 0, 0, -1)], certify=np.array([True, False])),
            "certify: expected True or",
        ),
        (lambda s: s.scene.cast_rays([(0, 0, 3, 0, 0, -1)], certify=NotTrue()), "certify: expected True or False"),
        (lambda s: isospline.Volume(np.zeros((3, 3, 3)), unit="\ud800"), "unit: expected a str"),
        (lambda s: isospline.Volume.sample([0, 0, 0]), "points: expected a value for this parameter of Volume.sample"),
        (lambda s: s.surface.to_mesh().export(), "path: expected a value for this parameter of Mesh.export"),
        (
            lambda s: isospline.Mesh(np.eye(3), [(0, 1, 2)], material=type("Material", (), {})()),
            "material: expected a Mat",
        ),
    ],
)
def test_what_cannot_be_converted_gets_one_sentence(volume, surface, scene, camera, call, beginning):
    with pytest.raises(TypeError) as caught:
        call(Subjects(volume=volume, surface=surface, scene=scene, camera=camera))
    assert str(caught.value).startswith(beginning) and "\n" not in str(caught.value)


def test_integers_out_of_range_are_told_with_their_bits(surface):
    with pytest.raises(ValueError, match="^faces: expected a whole number of 64 bits, got "):
        surface.to_mesh(faces=2**70)


@pytest.mark.parametrize("make", [lambda: isospline.Volume(np.zeros(3)), lambda: isospline.Isosurface(3, 0)])
def test_tracebacks_with_variables_show_what_was_not_made(make):
    with pytest.raises((TypeError, ValueError)) as caught:
        make()
    shown = "".join(traceback.TracebackException.from_exception(caught.value, capture_locals=True).format())
    assert ", not initialized>" in shown


def test_help_shows_no_compiled_signature():
    for kind in (
        isospline.Volume,
        isospline.Isosurface,
        isospline.Mesh,
        isospline.Scene,
        isospline.research.VoxelHopper,
    ):
        assert "arg1" not in pydoc.render_doc(kind)
