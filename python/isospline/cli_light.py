"""Options of the command line for materials, environments and silhouettes."""

from __future__ import annotations

from .tone import CURVES


def add_silhouettes(group):
    """The keyword arguments for silhouettes of `Phong` and the other shadings."""
    group.add_argument(
        "--silhouette-opacity",
        type=float,
        action="append",
        metavar="A",
        help="opacity where a surface turns away from the eye, 0 to 1, such as 1 for a visible edge; "
        "repeated, of each level and then of each mesh; by default that of --opacity",
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
            help=f"{text}; repeated, of each level and then of each mesh; for path-trace",
        )
    group.add_argument("--max-bounces", type=int, metavar="N", help="of a path of path-trace (default 16)")
    group.add_argument("--seed", type=int, metavar="N", help="seed of the noise of path-trace")


def add_ground(group, color):
    """The options of a ground; its colour is of the type `color`."""
    group.add_argument(
        "--ground",
        action="store_true",
        help="a ground on which the scene stands; for phong, ambient-occlusion and path-trace (studio has its own)",
    )
    group.add_argument("--ground-color", type=color, metavar="COLOR", help="of the ground, as in --color (default 0.6)")


def add_tone(group):
    """The keyword arguments of `Image.tone_map`."""
    group.add_argument("--exposure", type=float, metavar="STOPS", help="twice the light for each stop (default 0)")
    group.add_argument(
        "--tone-map",
        choices=CURVES,
        help="how light that is too bright for displays is compressed: neutral keeps colours, "
        "aces is like film, linear (default) clips; the background keeps its colour",
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
