"""Messages for wrong arguments: the parameter, the expected and the given value, and what was probably meant."""

from __future__ import annotations

import difflib
import inspect

from .foreign import meaning_of_keyword

# Names of our parameters in other libraries.
_SYNONYMS = {
    "colour": "color",
    "fov": "field_of_view",
    "yfov": "field_of_view",
    "view_angle": "field_of_view",
    "position": "eye",
    "origin": "eye",
    "look_at": "target",
    "lookat": "target",
    "focal_point": "target",
    "view_up": "up",
    "viewup": "up",
    "vup": "up",
    "isovalue": "level",
    "iso": "level",
    "value": "level",
    "threshold": "level",
    "contour_level": "level",
    "resolution": "size",
    "window_size": "size",
    "shape": "size",
    "imsize": "size",
    "spp": "samples",
    "bg": "background",
    "background_color": "background",
    "alpha": "opacity",
    "triangles": "faces",
    "indices": "faces",
    "points": "vertices",
    "affine": "direction",
    "order": "degree",
    "colormap": "cmap",
    "clim": "limits",
    "vmin": "limits",
    "vmax": "limits",
    "camera_position": "view",
    "callback": "progress",
    "framerate": "fps",
    "path": "filename",
    "filename": "path",
    "file": "path",
    "voxel_size": "spacing",
    "voxelsize": "spacing",
    "tmin": "t_near",
    "tmax": "t_far",
    "tnear": "t_near",
    "tfar": "t_far",
    "geometries": "objects",
    "meshes": "objects",
}

# What was probably meant by a value of this type for this parameter.
_MEANINGS = {
    ("scene", "Volume"): "Scene([Isosurface(volume, level)])",
    ("light", "Material"): "light=PathTracer(material) or light=Studio(material=...)",
    ("light", "str"): "light=Studio(), light=Phong() or light=PathTracer()",
    ("light", "DirectionalLight"): "light=Phong(lights=[DirectionalLight(...)])",
    ("light", "PositionalLight"): "light=Phong(lights=[PositionalLight(...)])",
    ("light", "EnvironmentLight"): "light=PathTracer(lights=[EnvironmentLight(...)])",
    ("light", "RectangleLight"): "light=PathTracer(lights=[RectangleLight(...)])",
    ("light", "SphereLight"): "light=PathTracer(lights=[SphereLight(...)])",
    ("light", "list"): "light=Phong(lights=[...]) or light=PathTracer(lights=[...])",
    ("material", "Phong"): "Material(color=...)",
    ("scene", "str"): "render(read_volume(path))",
    ("camera", "tuple"): 'camera_for(scene, view="front")',
    ("camera", "str"): "camera_for(scene, view=...)",
    ("images", "ndarray"): "the images that render() returns",
    ("volume", "Isosurface"): "surface.volume",
    ("data", "Image"): "Volume.from_sitk(image)",
    ("data", "Nifti1Image"): "Volume.from_nibabel(image)",
    ("data", "vtkImageData"): "Volume.from_vtk(image_data)",
    ("data", "ImageData"): "Volume.from_pyvista(image_data)",
    ("data", "VolumeData"): "data.to_volume()",
    ("data", "str"): "read_volume(path).to_volume()",
    ("data", "PosixPath"): "read_volume(path).to_volume()",
    ("volume", "Image"): "Volume.from_sitk(image)",
    ("volume", "Nifti1Image"): "Volume.from_nibabel(image)",
    ("volume", "ImageData"): "Volume.from_pyvista(image_data)",
    ("volume", "str"): "read_volume(path).to_volume()",
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
    return kind.__qualname__ if kind.__module__ in ("builtins", "isospline._core") else _full_name(kind)


def _full_name(kind):
    module = kind.__module__
    return f"{'isospline' if module.startswith('isospline.') else module}.{kind.__qualname__}"


def sentence(parameter, expected, value, meaning=None):
    """`parameter: expected ..., got ...`, and what was probably meant."""
    meaning = meaning or _meaning(parameter, value)
    hint = f"; did you mean {meaning}?" if meaning else ""
    return f"{parameter}: expected {expected}, got {described(value)}{hint}"


def _meaning(parameter, value):
    if inspect.isclass(value):
        return f"{value.__name__}(...)"
    if parameter == "size" and isinstance(value, int) and not isinstance(value, bool):
        return f"({value}, {value})"
    if parameter in ("size", "shape") and isinstance(value, (tuple, list)) and len(value) == 2:
        return None
    for kind in type(value).__mro__:
        if (parameter, kind.__name__) in _MEANINGS:
            return _MEANINGS[parameter, kind.__name__]
    return None


def refuse_images(data):
    """Refuse images of other libraries: NumPy would treat them as arrays and lose their place in the world."""
    meaning = _meaning("data", data)
    if meaning is not None and meaning.startswith("Volume.from_"):
        raise TypeError(sentence("data", "a three-dimensional array of real numbers", data))


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
        meaning = f"; did you mean {by_keyword[0]}={described(extra)}?" if len(by_keyword) == 1 else ""
        others = f" and the keywords {', '.join(by_keyword)}" if by_keyword else ""
        place = f"in position {len(by_position) + 1}"
        return f"{name}: expected {places} by position{others}, got {described(extra)} {place}{meaning}"
    for each in by_position[: len(positional)]:
        if each.name in keywords:
            return f"{each.name}: expected one value for this parameter of {name}, got two, by position and by keyword"
    for each in parameters.values():
        given = each.name in keywords or each in by_position[: len(positional)]
        if not given and each.default is each.empty and each.kind not in (each.VAR_KEYWORD, each.VAR_POSITIONAL):
            return f"{each.name}: expected a value for this parameter of {name}, got none"
    return None


def _unknown_keyword(name, keyword, parameters):
    meant = meaning_of_keyword(name.rpartition(".")[2], keyword)
    if meant is not None:
        return f"{keyword}: unknown keyword of {name}; did you mean {meant}?"
    synonym = _SYNONYMS.get(keyword.lower())
    close = [synonym] if synonym in parameters else difflib.get_close_matches(keyword.lower(), parameters, 1)
    meaning = f"; did you mean {close[0]}?" if close else ""
    expected = f"a parameter of {name} ({', '.join(parameters)})" if parameters else f"no parameter, as {name} has none"
    return f"{keyword}: expected {expected}, got an unknown keyword{meaning}"
