"""What the options of the command line make of things: their colours, materials, and the light on them."""

from __future__ import annotations

import math

import isospline

#: What --color-by takes beside a file, and the kinds of curvature.
CURVATURES = {f"{kind}-curvature": kind for kind in ("mean", "gaussian", "maximum", "minimum")}

#: What --shading takes, and the options that not all of them understand.
SHADINGS = {
    "phong": ("light", "shadows", "opacity"),
    "outline": ("opacity",),
    "ambient-occlusion": ("opacity",),
    "path-trace": ("light", "environment", "denoise"),
}


def looks(arguments, count):
    """How each of `count` objects looks: a shading each, or materials; and the lights of the latter, or None."""
    for option in ("light", "shadows", "opacity", "environment", "denoise"):
        shadings = [shading for shading, options in SHADINGS.items() if option in options]
        if getattr(arguments, option) and arguments.shading not in shadings:
            expected = ", ".join(shadings[:-1]) + " or " * (len(shadings) > 1) + shadings[-1]
            raise ValueError(f"--{option}: expected --shading {expected} beside it, got {arguments.shading}")

    colors = _colors(arguments, count)
    opacities = _each("opacity", arguments.opacity or [1.0], count)
    lights = arguments.light and [_directional(light) for light in arguments.light]
    if arguments.shading == "phong":
        options = dict(lights=lights, shadows=arguments.shadows)
        return [isospline.Phong(**look, **options) for look in _together(colors, opacities)], None
    if arguments.shading == "outline":
        surfaces = [{f"surface_{name}": color for name, color in each.items()} for each in colors]
        return [isospline.Outline(arguments.exponent, **look) for look in _together(surfaces, opacities)], None
    if arguments.shading == "ambient-occlusion":
        return [isospline.AmbientOcclusion(**look) for look in _together(colors, opacities)], None
    materials = [isospline.Material(*color.values()) for color in colors]
    # Irradiance that lets white that faces it send back 1, as it is with Phong.
    lights = [_directional(light, math.pi) for light in arguments.light or ()]
    if arguments.environment is not None:
        lights.append(_environment(arguments.environment))
    return materials, lights or [isospline.EnvironmentLight()]


def _colors(arguments, count):
    """The keyword color, of each object, and of none where there is no such option."""
    by = _color_by(arguments)
    given = arguments.color
    if not given:
        return [{} if by is None else {"color": by}] * count
    if by is not None:
        raise ValueError(f"--color: expected it without --color-by, got --color-by {arguments.color_by}")
    return [{"color": color} for color in _each("color", given, count)]


def _each(option, given, count):
    """What an option gives for each object: one for all, or as many as there are."""
    if len(given) not in (1, count):
        raise ValueError(f"--{option}: expected 1, or {count} for all levels and meshes, got {len(given)}")
    return given if len(given) == count else given * count


def _together(colors, opacities):
    return [{**color, "opacity": opacity} for color, opacity in zip(colors, opacities)]


def _color_by(arguments):
    """The rule that a surface's colour follows from, or None."""
    what = arguments.color_by
    options = {name: getattr(arguments, name) for name in ("cmap", "limits") if getattr(arguments, name) is not None}
    if what in (None, "normal"):
        if options:
            raise ValueError(f"--{min(options)}: expected --color-by with something that has a value, got {what}")
        return what and isospline.ColorByNormal()
    if what == "depth":
        return isospline.ColorByDepth(**options)
    if what in CURVATURES:
        if arguments.limits is None:
            raise ValueError("--limits: expected two curvatures for --color-by, such as -0.5,0.5, got none")
        return isospline.ColorByCurvature(CURVATURES[what], **options)
    return isospline.ColorByVolume(isospline.read_volume(what).to_volume(), **options)


def _directional(light, unit=1.0):
    """The light from a side: x, y, z and, where there are four numbers, its intensity."""
    x, y, z, *intensity = light
    if not any((x, y, z)):
        raise ValueError("--light: expected a side, which is not 0,0,0, got 0,0,0")
    return isospline.DirectionalLight((-x, -y, -z), intensity=unit * (intensity[0] if intensity else 1.0))


def _environment(sky):
    if not isinstance(sky, str):
        return isospline.EnvironmentLight(sky if len(sky) == 3 else sky[0])
    return isospline.EnvironmentLight(image=_read_exr(sky))


def _read_exr(path):
    """Red, green and blue of an OpenEXR file."""
    import numpy as np

    with open(path, "rb"):
        pass
    try:
        import OpenEXR
    except ImportError as error:
        raise ImportError("--environment: reading .exr needs the package OpenEXR: pip install OpenEXR") from error
    try:
        with OpenEXR.File(path, separate_channels=True) as file:
            channels = file.channels()
            return np.stack([np.asarray(channels[name].pixels, np.float32) for name in "RGB"], axis=-1)
    except KeyError as missing:
        raise ValueError(f"{path}: expected channels R, G and B, got none named {missing.args[0]}") from None
    except Exception as error:
        raise ValueError(f"{path}: cannot be read as OpenEXR: {error}") from error
