"""The light of pictures and the look of objects: their options on the command line, and what is made of them."""

from __future__ import annotations

import argparse
import math

import isospline

from ..colors import CURVATURES, linear
from ..picture.environments import upright_rotation
from ..picture.materials import UNLIT
from ..picture.tone import CURVES
from ..scene.mesh_files import MESH_SUFFIXES
from .given import flag, given, keywords, refuse_without
from .picture import studio_looks
from .store import finite, opened
from .units import volume_to_unit

OPACITY = ("opacity", "silhouette_opacity", "silhouette_exponent")
ENVIRONMENT = ("environment", "environment_intensity", "environment_rotation", "environment_visible")
MATERIAL = ("metallic", "roughness", "specular")
PATH_TRACER = ("max_bounces", "seed")
GROUND = ("ground", "ground_color")
TONE = ("tone_map", "exposure")
#: The options of path traced pictures that take long; those of --resume are also for a turntable.
LONG = ("noise", "time_limit", "checkpoint")
LIMITS = (*LONG, "resume")

#: The values of --light, and the options that not all of them support.
LIGHTS: dict[str, tuple[str, ...]] = {
    "studio": ("fast", *OPACITY),
    "phong": ("lamp", "shadows", *GROUND, *TONE, *OPACITY),
    "unlit": (*GROUND, *OPACITY),
    "outline": ("exponent", *TONE, *OPACITY),
    "ambient-occlusion": (*GROUND, *TONE, *OPACITY),
    "path-trace": ("lamp", "denoise", *GROUND, *TONE, *ENVIRONMENT, *MATERIAL, *PATH_TRACER, *LONG),
}


def looks(arguments, count, to_unit=None):
    """The shading or the material of each of `count` objects, and a function that makes the light of a dict of them.

    ``to_unit(given, path)`` is a transform of what the file of --color-by gives to the unit of the scene, or None.
    """
    for option in sorted({option for options in LIGHTS.values() for option in options}):
        shadings = [shading for shading, options in LIGHTS.items() if option in options]
        if arguments.light not in shadings:
            expected = ", ".join(shadings[:-1]) + " or " * (len(shadings) > 1) + shadings[-1]
            refuse_without(arguments, [option], f"--light {expected}", arguments.light)
    if not arguments.ground:
        refuse_without(arguments, ["ground_color"], "--ground")
    colors = _colors(arguments, count, to_unit or (lambda *_: None))
    opacities = _opacities(arguments, count)
    lights = arguments.lamp and [_directional(lamp) for lamp in arguments.lamp]
    if arguments.light == "studio":
        studio = isospline.Studio(fast=arguments.fast, up=arguments.up)
        return studio_looks(colors, opacities), lambda materials: studio.replace(materials=materials)
    if arguments.light == "phong":
        options = dict(lights=lights, shadows=arguments.shadows)
        return [isospline.Phong(**look, **options) for look in _together(colors, opacities)], dict
    if arguments.light == "unlit":
        return [isospline.Phong(**look, **UNLIT) for look in _together(colors, opacities)], dict
    if arguments.light == "outline":
        surfaces = [{f"surface_{name}": color for name, color in each.items()} for each in colors]
        options = keywords(arguments, ["exponent"])
        return [isospline.Outline(**look, **options) for look in _together(surfaces, opacities)], dict
    if arguments.light == "ambient-occlusion":
        return [isospline.AmbientOcclusion(**look) for look in _together(colors, opacities)], dict
    materials = [
        isospline.Material(*color.values(), **keywords)
        for color, keywords in zip(colors, _keywords(arguments, MATERIAL, count))
    ]
    # The irradiance at which a white surface that faces the light reflects 1, as with Phong.
    lights = [_directional(lamp, math.pi) for lamp in arguments.lamp or ()]
    environment = _environment(arguments)
    if environment is not None or not lights:
        lights.append(environment or isospline.EnvironmentLight())
    path_tracer = isospline.PathTracer(lights=lights, **keywords(arguments, PATH_TRACER))
    return materials, lambda each: path_tracer.replace(materials=each)


def ground_look(arguments, looks):
    """The shading or the material of the ground, in the light of the others."""
    color = arguments.ground_color or linear((0.6, 0.6, 0.6))
    if arguments.light == "path-trace":
        return isospline.Material(color, specular=0)
    matt = {"specular": 0} if arguments.light == "phong" else {}
    return looks[0].replace(color=color, cap_color=None, opacity=1, silhouette_opacity=None, **matt)


def _colors(arguments, count, to_unit):
    """The keyword color for each object; empty if the option was not given."""
    by = _color_by(arguments, to_unit)
    if not arguments.color:
        return [{} if by is None else {"color": by}] * count
    if by is not None:
        raise ValueError("--color cannot be combined with --color-by")
    return [{"color": color} for color in _each("color", arguments.color, count)]


def _opacities(arguments, count):
    """The keywords for each object's opacity."""
    if not arguments.silhouette_opacity:
        refuse_without(arguments, ["silhouette_exponent"], "--silhouette-opacity")
    exponent = keywords(arguments, ["silhouette_exponent"])
    return [{**look, **exponent} for look in _keywords(arguments, ("opacity", "silhouette_opacity"), count)]


def _keywords(arguments, options, count):
    """The keywords that repeated options give for each object."""
    each = {option: _each(option, getattr(arguments, option), count) for option in given(arguments, options)}
    return [{option: values[number] for option, values in each.items()} for number in range(count)]


def _each(option, values, count):
    """The value of an option for each object: one for all, or one each."""
    if len(values) not in (1, count):
        raise ValueError(f"{flag(option)}: expected 1, or {count} for all levels and meshes, got {len(values)}")
    return values if len(values) == count else values * count


def _together(colors, others):
    return [{**color, **other} for color, other in zip(colors, others)]


def _color_by(arguments, to_unit):
    """The rule for a surface's colour, or None."""
    what = arguments.color_by
    options = keywords(arguments, ("cmap", "limits"))
    if what in (None, "normal"):
        refuse_without(arguments, options, "--color-by with something that has a value", what)
        return what and isospline.ColorByNormal()
    if what == "depth":
        return isospline.ColorByDepth(**options)
    if what == "thickness":
        return isospline.ColorByThickness(**options)
    if what in CURVATURES:
        if arguments.limits is None:
            raise ValueError("--limits: expected two curvatures for --color-by, such as -0.5,0.5, got none")
        return isospline.ColorByCurvature(CURVATURES[what], **options)
    if what.lower().endswith(MESH_SUFFIXES):
        if arguments.limits is None:
            raise ValueError("--limits: expected two distances for --color-by with a mesh, such as -1,1, got none")
        mesh = isospline.read_mesh(what)
        return isospline.ColorByDistance(isospline.Scene([(mesh, to_unit(mesh, what))]), **options)
    data = opened(argparse.Namespace(file=what), lambda _: finite(isospline.read_volume(what), what))
    volume, transform = volume_to_unit(to_unit, data, what)
    return isospline.ColorByVolume(volume, transform=transform, **options)


def _directional(lamp, unit=1.0):
    """The light in a direction: x, y, z and, if there are four numbers, its intensity."""
    x, y, z, *intensity = lamp
    if not any((x, y, z)):
        raise ValueError("--lamp: expected a direction, which is not 0,0,0, got 0,0,0")
    return isospline.DirectionalLight((x, y, z), intensity=unit * (intensity[0] if intensity else 1.0))


def _environment(arguments):
    """The environment that the options ask for, or None."""
    sky, rotation = arguments.environment, arguments.environment_rotation
    if sky is None:
        refuse_without(arguments, ENVIRONMENT[1:], "--environment")
        return None
    intensity = 1.0 if arguments.environment_intensity is None else arguments.environment_intensity
    if not 0 <= intensity < math.inf:
        raise ValueError(f"--environment-intensity: expected a finite number of at least 0, got {intensity:g}")
    visible = arguments.environment_visible
    if not isinstance(sky, str):
        refuse_without(
            arguments, ["environment_rotation"], "an image in --environment", ",".join(f"{part:g}" for part in sky)
        )
        return isospline.EnvironmentLight([intensity * part for part in sky] * (3 // len(sky)), visible=visible)
    up, degrees = arguments.up or (0, 0, 1), 0.0 if rotation is None else rotation
    if not (math.isfinite(degrees) and all(map(math.isfinite, up)) and any(up)):
        raise ValueError(f"--environment-rotation: expected finite degrees and a direction --up, got {degrees}, {up}")
    upright = upright_rotation(up, degrees)
    return isospline.EnvironmentLight(
        intensity, image=isospline.read_environment(sky), rotation=upright, visible=visible
    )


def add_silhouettes(group):
    """The keyword arguments for silhouettes of `Phong` and the other shadings."""
    group.add_argument(
        "--silhouette-opacity",
        type=float,
        action="append",
        metavar="A",
        help="opacity where a surface turns away from the eye, 0 to 1, such as 1 for a visible edge; "
        "repeated, for each level and then for each mesh; by default that of --opacity; not for path-trace",
    )
    group.add_argument(
        "--silhouette-exponent", type=float, metavar="N", help="the larger, the thinner the silhouette (default 3)"
    )


def add_materials(group):
    """The keyword arguments of `Material` and `PathTracer`."""
    for name, text in (
        ("metallic", "0 to 1: metal (default 0)"),
        ("roughness", "0 to 1: matt (default 0.5)"),
        ("specular", "0 to 1: reflection of non-metals (default 0.5)"),
    ):
        group.add_argument(
            f"--{name}",
            type=float,
            action="append",
            metavar="X",
            help=f"{text}; repeated, for each level and then for each mesh; for path-trace",
        )
    group.add_argument("--max-bounces", type=int, metavar="N", help="of a path, for path-trace (default 16)")
    group.add_argument("--seed", type=int, metavar="N", help="of the noise of path-trace (default 0)")


def add_ground(group, color):
    """The options of a ground; its colour is of the type `color`."""
    group.add_argument(
        "--ground",
        action="store_true",
        help="a ground on which the scene stands; for phong, unlit, ambient-occlusion and path-trace; "
        "studio has its own",
    )
    group.add_argument(
        "--ground-color", type=color, metavar="COLOR", help="of the ground, as in --color (default #cbcbcb)"
    )


def add_tone(group):
    """The keyword arguments of `Image.tone_map`."""
    group.add_argument(
        "--exposure",
        type=float,
        metavar="STOPS",
        help="twice the light for each stop (default 0); not for studio and unlit",
    )
    group.add_argument(
        "--tone-map",
        choices=CURVES,
        help="how light that is too bright for displays is compressed: neutral keeps colours, "
        "aces is like film, linear (default) clips; the background keeps its colour; not for unlit, nor for studio, "
        "which does it",
    )


def add_environment(group):
    """The keyword arguments of `EnvironmentLight`, except its light."""
    group.add_argument("--environment-intensity", type=float, metavar="X", help="factor of its light (default 1)")
    group.add_argument(
        "--environment-rotation",
        type=float,
        metavar="DEGREES",
        help="rotation about the upward direction, anticlockwise from above",
    )
    group.add_argument("--environment-visible", action="store_true", help="show it behind the surfaces")
