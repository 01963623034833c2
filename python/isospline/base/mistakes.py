"""Messages for wrong arguments: the parameter, the expected and the given value, and what was probably meant."""

from __future__ import annotations

import inspect
import numbers
import os
import re

import numpy as np

from .foreign import close_name, meaning_of_keyword
from .handed import handed

# Images of other libraries, and what makes a volume of them.
_IMAGES = {
    "SimpleITK.Image": "Volume.from_sitk(image)",
    "nibabel.Nifti1Image": "Volume.from_nibabel(image)",
    "pyvista.ImageData": "Volume.from_pyvista(image_data)",
    "vtkmodules.vtkImageData": "Volume.from_vtk(image_data)",
}

# What was probably meant by a value for a parameter: the parameter; the value's type, with its package; a word that the
# expected value must have, as several functions have a parameter of this name; and the meaning.
_MEANINGS = (
    ("scene", "isospline.Volume", "", "Scene([Isosurface(volume, level)])"),
    ("scene", "isospline.VolumeData", "", "Scene([Isosurface(data, level)])"),
    ("scene", "path", "", "Scene([Isosurface(read_volume(path), level)])"),
    ("objects", "numpy.ndarray", "", "Scene([(surface, matrix)])"),
    ("material", "isospline.Phong", "Material", "Material(color=...)"),
    ("camera", "builtins.str", "PerspectiveCamera", "camera_for(scene, view=...)"),
    ("function", "builtins.list", "picture", "write_video(path, images)"),
    ("function", "builtins.generator", "picture", "write_video(path, images)"),
    ("function", "isospline.Scene", "picture", "turntable(scene, path)"),
    ("function", "isospline.Isosurface", "picture", "turntable(scene, path)"),
    ("function", "isospline.Mesh", "picture", "turntable(scene, path)"),
    ("images", "numpy.ndarray", "Image", "the images that render() returns"),
    ("volume", "isospline.Isosurface", "colours", "ColorByVolume(other), with a volume that varies on the surface"),
    ("volume", "isospline.Isosurface", "", "surface.volume"),
    *(("volume", kind, "", meaning) for kind, meaning in _IMAGES.items()),
    ("volume", "path", "", "read_volume(path)"),
    *(("data", kind, "labels", "Labels(VolumeData.from_affine(array, affine))") for kind in _IMAGES),
    *(("data", kind, "three-dimensional", meaning) for kind, meaning in _IMAGES.items()),
    ("data", "isospline.VolumeData", "three-dimensional", "data.to_volume()"),
    ("data", "path", "three-dimensional", "read_volume(path).to_volume()"),
    ("data", "path", "", "read_volume(path)"),
)

# Lights that have a lamp.
_LIGHTS_OF = {
    "DirectionalLight": ("Phong", "PathTracer"),
    "PositionalLight": ("Phong", "PathTracer"),
    "EnvironmentLight": ("PathTracer",),
    "RectangleLight": ("PathTracer",),
    "SphereLight": ("PathTracer",),
}


def described(value):
    """A value in a few words, without the contents of arrays."""
    kind = type(value)
    if value is None or isinstance(value, (bool, int, float, complex)):
        text = repr(value)
        return text if len(text) <= 40 else kind.__name__
    if isinstance(value, (str, bytes)):
        return repr(value) if len(value) <= 40 else f"{value[:37]!r}..."
    shape = getattr(value, "shape", None)
    if isinstance(shape, tuple) and hasattr(value, "dtype"):
        return f"{kind.__name__} of shape {tuple(shape)} and type {value.dtype}"
    if isinstance(value, (list, tuple)):
        if all(isinstance(item, (bool, int, float, str, type(None))) for item in value) and len(repr(value)) <= 40:
            return repr(value)
        names = sorted({type(item).__name__ for item in value})
        of = " and ".join(names) if len(names) <= 2 else "several types"
        return f"{kind.__name__} of {len(value)} {of}"
    if isinstance(value, dict):
        keys, items = ({type(each).__name__ for each in side} for side in (value.keys(), value.values()))
        return f"dict of {' and '.join(sorted(keys))} to {' and '.join(sorted(items))}" if value else "an empty dict"
    if inspect.isclass(value):
        return f"the class {value.__name__}"
    is_ours = kind.__module__.partition(".")[0] == "isospline"
    return kind.__qualname__ if is_ours or kind.__module__ == "builtins" else _full_name(kind)


def _full_name(kind):
    module = kind.__module__
    return f"{'isospline' if module.startswith('isospline.') else module}.{kind.__qualname__}"


@handed
def sentence(parameter, expected, value, meaning=None):
    """`parameter: expected ..., got ...`, and what was probably meant."""
    meaning = meaning or _meaning(parameter, expected, value)
    hint = f"; did you mean {meaning}?" if meaning else ""
    return f"{parameter}: expected {expected}, got {described(value)}{hint}"


def _meaning(parameter, expected, value):
    """What was probably meant, if the function takes it; `expected` is what it takes, in words."""
    if inspect.isclass(value):
        return f"{value.__name__}(...)" if _has_word(expected, value.__name__) else None
    if parameter == "size" and isinstance(value, int) and not isinstance(value, bool) and value > 0:
        return f"({value}, {value})"
    if parameter == "light":
        return _light_of(expected, value)
    if (
        parameter == "camera"
        and isinstance(value, (tuple, list, np.ndarray))
        and _has_word(expected, "PerspectiveCamera")
    ):
        return _camera_of(value)
    kinds = _kinds(value)
    for name, kind, word, meaning in _MEANINGS:
        if name == parameter and kind in kinds and word in expected:
            return meaning
    return None


def _has_word(text, word):
    return re.search(rf"\b{word}\b", text) is not None


def _kinds(value):
    """The types of a value with their packages; paths are one type."""
    kinds = [f"{kind.__module__.partition('.')[0]}.{kind.__name__}" for kind in type(value).__mro__]
    return [*kinds, "path"] if isinstance(value, (str, os.PathLike)) else kinds


def _light_of(expected, value):
    """The lights that have a lamp, several lamps or a material."""
    lamps = list(value) if isinstance(value, (tuple, list)) else [value]
    names = [type(each).__name__ for each in lamps]
    if names == ["Material"] and lamps[0] is value:
        meanings = {"PathTracer": "PathTracer(material)", "Studio": "Studio(material=material)"}
    elif names and all(name in _LIGHTS_OF for name in names):
        lights = "..." if lamps[0] is not value else f"{names[0]}(...)"
        common = [light for light in ("Phong", "PathTracer") if all(light in _LIGHTS_OF[name] for name in names)]
        meanings = {light: f"{light}(lights=[{lights}])" for light in common}
    else:
        return None
    return " or ".join(f"light={meaning}" for light, meaning in meanings.items() if _has_word(expected, light)) or None


def _camera_of(value):
    """The camera of an eye, or of an eye, a target and the direction up."""
    try:
        shape = np.shape(value)
    except ValueError:  # ragged
        return None
    meanings = {(3,): "PerspectiveCamera(eye, target)", (3, 3): "PerspectiveCamera.from_pyvista(camera_position)"}
    return meanings.get(shape)


@handed
def refuse_images(data, expected="a three-dimensional array of real numbers"):
    """Refuse images: NumPy would treat volumes as arrays and lose their place in the world, and pictures as volumes."""
    kinds = _kinds(data)
    if _meaning("data", expected, data) is not None or "isospline.Image" in kinds or "PIL.Image" in kinds:
        raise TypeError(sentence("data", expected, data))


def wrong_call(name, signature, positional, keywords):
    """The error in the number or the names of a call's arguments, or None."""
    parameters = signature.parameters
    positions = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)
    by_position = [each for each in parameters.values() if each.kind in positions]
    by_keyword = [each.name for each in parameters.values() if each.kind is each.KEYWORD_ONLY]
    takes_any = {each.kind for each in parameters.values()}
    for keyword in keywords:
        if keyword not in parameters and inspect.Parameter.VAR_KEYWORD not in takes_any:
            return _unknown_keyword(name, keyword, list(parameters))
    if len(positional) > len(by_position) and inspect.Parameter.VAR_POSITIONAL not in takes_any:
        extra = positional[len(by_position)]
        places = ", ".join(each.name for each in by_position) or "no arguments"
        meaning = _meaning_of_extra(parameters, extra)
        hint = f"; did you mean {meaning}?" if meaning else ""
        others = f" and the keyword{'s' * (len(by_keyword) > 1)} {', '.join(by_keyword)}" if by_keyword else ""
        place = f"in position {len(by_position) + 1}"
        return f"{name}: expected {places} by position{others}, got {described(extra)} {place}{hint}"
    for each in by_position[: len(positional)]:
        if each.name in keywords:
            return f"{each.name}: expected one value for this parameter of {name}, got two, by position and by keyword"
    for each in parameters.values():
        given = each.name in keywords or each in by_position[: len(positional)]
        if not given and each.default is each.empty and each.kind not in (each.VAR_KEYWORD, each.VAR_POSITIONAL):
            return f"{each.name}: expected a value for this parameter of {name}, got none"
    return None


def _meaning_of_extra(parameters, extra):
    """What was probably meant by the first of too many positional arguments."""
    by_keyword = [each for each in parameters.values() if each.kind is each.KEYWORD_ONLY]
    if len(by_keyword) > 1:  # most long operations have it, and few mean it
        by_keyword = [each for each in by_keyword if each.name != "progress"]
    if len(by_keyword) != 1 or not _fits(by_keyword[0].annotation, extra):
        return None
    plain = isinstance(extra, (bool, numbers.Number, str, tuple, list))
    return f"{by_keyword[0].name}={described(extra) if plain else '...'}"


def _options(annotation):
    """The members of a union, from the text of an annotation: ``int | None``."""
    text = annotation if isinstance(annotation, str) else getattr(annotation, "__name__", "")
    return [option.strip("' ") for option in re.split(r"\||,(?![^\[(]*[\])])", text)]


def _fits(annotation, value):
    """Whether a value has the type of a parameter, by the text of its annotation. False if it may not."""
    options = _options(annotation)
    if isinstance(value, (bool, np.bool_)):
        return "bool" in options
    if isinstance(value, numbers.Real):
        return "float" in options or ("int" in options and isinstance(value, numbers.Integral))
    if isinstance(value, str):
        return "str" in options or any(option.startswith("Literal") and repr(value) in option for option in options)
    if isinstance(value, (tuple, list, np.ndarray)):
        shape = np.shape(value) if all(isinstance(each, numbers.Real) for each in value) else None
        return any(shape == _shape_of(option) for option in options if _shape_of(option))
    if callable(value) and not inspect.isclass(value):
        return any(option in ("callable", "Progress") for option in options)
    return any(kind.__name__ in options for kind in type(value).__mro__[:-1])


def _shape_of(option):
    """The shape of numbers: (2,) of ``tuple[float, float]``; None for others."""
    tuple_of = re.fullmatch(r"tuple\[((?:float|int)(?:, (?:float|int))*)\]", option)
    return (tuple_of[1].count(",") + 1,) if tuple_of else None


def _unknown_keyword(name, keyword, parameters):
    meant = meaning_of_keyword(name, keyword)
    if meant is not None:
        return f"{keyword}: unknown keyword of {name}; did you mean {meant}?"
    meant = meaning_of_keyword(name, keyword, parameters) or close_name(keyword, parameters)
    meaning = f"; did you mean {meant}?" if meant else ""
    expected = f"a parameter of {name} ({', '.join(parameters)})" if parameters else f"no parameter, as {name} has none"
    return f"{keyword}: expected {expected}, got an unknown keyword{meaning}"
