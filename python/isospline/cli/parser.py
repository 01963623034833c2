"""The options of the command line."""

from __future__ import annotations

import argparse
import re

import isospline

from ..base.views import DEFAULT_VIEW
from ..colors import CURVATURES
from ..interop.mesh_output import MESHES
from ..picture.layers import LAYERS
from . import types as cli_types
from .cluster import add_cluster_options
from .compare import add_compare
from .convert import add_convert
from .labels import add_labels
from .light_options import LIGHTS, add_environment, add_ground, add_materials, add_silhouettes, add_tone
from .limits import add_limits
from .mesh import add_mesh_options
from .picture import add_inside, add_largest, add_picture_options, background, color
from .store import add_memory_limit, add_store_options
from .verify import add_verify

#: Exit codes: of an error, of bad arguments and files, and after Ctrl-C.
FAILED, BAD_INPUT, INTERRUPTED = 1, 2, 130

# What is shown, written or measured by default.
_LEVEL = "by default the first suggested one, of a patient's CT the first above water"
_LARGEST = "all; without --level, all but specks of noise, plates, and what is not the body of a CT or a head"


class _Parser(argparse.ArgumentParser):
    """A parser whose errors are one line, like all others."""

    def error(self, message):
        self.exit(BAD_INPUT, f"isospline: error: {message} (try {self.prog} --help)\n")


def make_parser(demo, info, measure, compare, verify, render, mesh, view, convert):
    """The parser of the command line; its arguments are the functions of the commands."""
    parser = _Parser(prog="isospline", description=isospline.__doc__)
    parser.add_argument("--version", action="version", version=f"isospline {isospline.__version__}")
    parser.set_defaults(run=lambda _: parser.print_help())
    commands = parser.add_subparsers(metavar="COMMAND")

    command = commands.add_parser("demo", help="make a volume and a picture of it, without any file")
    command.add_argument(
        "-o",
        "--output",
        default="isospline-demo",
        metavar="FOLDER",
        help="where to write demo.npy and demo.png (default isospline-demo)",
    )
    command.add_argument("-q", "--quiet", action="store_true", help="show no progress")
    command.set_defaults(run=demo)

    command = commands.add_parser(
        "info", help="print size, position, range, histogram and suggested levels of a volume"
    )
    _add_input(command)
    command.add_argument("--json", action="store_true", help="print JSON")
    add_memory_limit(command)
    command.set_defaults(run=info)

    kinds = f"{', '.join(MESHES[:-1])} or {MESHES[-1]}"
    command = commands.add_parser("mesh", help="write the triangle mesh of an isosurface")
    _add_input(command)
    command.add_argument("-o", "--output", required=True, metavar="OUT", help=f"mesh to write: {kinds}")
    command.add_argument("-q", "--quiet", action="store_true", help="show no progress")
    command.set_defaults(run=mesh)
    group = command.add_argument_group("surface")
    group.add_argument("-l", "--level", type=float, action="append", help=f"value on the surface; {_LEVEL}")
    add_mesh_options(group)
    _add_model(group)
    group.add_argument("--threads", type=cli_types.count, metavar="N", help="threads to use; by default all")
    _add_cuts(command)
    add_memory_limit(command)

    command = commands.add_parser("measure", help="print volume, area, curvature and components of an isosurface")
    _add_input(command)
    command.add_argument("-q", "--quiet", action="store_true", help="show no progress")
    command.add_argument("--json", action="store_true", help="print JSON")
    command.add_argument("-o", "--output", metavar="OUT", help="write a table of the levels or labels: .csv")
    command.add_argument("--tolerance", type=float, metavar="T", help="largest relative errors (default 1e-4)")
    command.add_argument("--order", type=int, metavar="N", help="instead of --tolerance: nodes along axes, 2 to 10")
    command.set_defaults(run=measure)
    group = command.add_argument_group("surface")
    group.add_argument(
        "-l",
        "--level",
        type=float,
        action="append",
        help=f"value on the surface; repeated, one surface after the other; {_LEVEL}",
    )
    _add_model(group)
    add_labels(command)
    _add_cuts(command)
    add_memory_limit(command)

    _add_view(commands.add_parser("view", help="show volumes and meshes in the browser"), view)
    add_convert(commands, convert, _add_reading, _add_spline, cli_types.numbers)
    add_compare(commands, compare, _add_input, _add_model, cli_types)
    add_verify(commands, verify, _add_input)
    command = commands.add_parser("render", help="make a picture of isosurfaces and meshes")
    _add_input(command, optional=True)
    command.add_argument(
        "--session",
        metavar="FILE",
        help="a session saved by the viewer, in place of FILE and of options of surfaces, cuts, view and light; with "
        "--size, --samples, --layers, --annotate and --legend",
    )
    command.add_argument(
        "-o",
        "--output",
        required=True,
        metavar="OUT",
        help="picture to write: .png or .exr; of a turntable .mp4, .gif, a folder or, with numbers, turn-####.png",
    )
    command.add_argument("-q", "--quiet", action="store_true", help="show no progress")
    command.add_argument(
        "--frames",
        action="store_true",
        help="FILE is a store of a time series, or a folder of volumes: a picture of each, OUT a folder for them or "
        "frame-####.png; pictures that were made of the same volumes with the same options are kept",
    )
    command.set_defaults(run=render, cameras=None)

    group = command.add_argument_group("surfaces")
    group.add_argument(
        "-l",
        "--level",
        type=float,
        action="append",
        help=f"value on the surface; repeated, one surface for each; {_LEVEL}",
    )
    group.add_argument(
        "--mesh",
        action="append",
        metavar="FILE",
        default=[],
        help="triangles to show as well, in the volume's world; FILE@X,Y,Z moves them, and FILE@MATRIX "
        "places them by a file with 4 x 4 numbers; may be repeated",
    )
    _add_model(group)
    add_labels(command).add_argument("--legend", action="store_true", help="draw names beside their colours")

    _add_cuts(command, closes=True)

    group = command.add_argument_group("picture")
    group.add_argument(
        "--size", type=cli_types.size, default=(640, 480), metavar="WxH", help="in pixels (default 640x480)"
    )
    group.add_argument(
        "--view",
        type=cli_types.view,
        default=DEFAULT_VIEW,
        metavar="SIDE",
        help="side of the eye: front, back, left, right (the object's own), top, bottom, anterior, "
        "posterior, superior, inferior, iso, three-quarter, +x to -z, X,Y,Z; by default suggested: "
        "three-quarter, or from the front of what is recognised",
    )
    group.add_argument(
        "--up",
        type=cli_types.up,
        metavar="AXIS",
        help="the upward direction in the picture, +x to -z or X,Y,Z: -z if slices run from head to feet",
    )
    group.add_argument(
        "--projection", choices=("perspective", "orthographic"), default="perspective", help="by default perspective"
    )
    group.add_argument("--field-of-view", type=float, metavar="DEGREES", help="vertical (default 30)")
    group.add_argument("--turntable", type=int, metavar="N", help="N pictures, or a video of them, from all around")
    group.add_argument("--fps", type=float, metavar="N", help="frames per second of a video (default 30)")
    group.add_argument("--aperture", type=float, metavar="RADIUS", help="of a lens, world units, for depth of field")
    group.add_argument(
        "--focus", type=float, metavar="DISTANCE", help="of the plane in focus, world units; by default the middle"
    )
    group.add_argument("--samples", type=int, metavar="N", help="rays per pixel (default 4, path-trace 64)")
    add_picture_options(group)
    group.add_argument(
        "--background",
        type=background,
        metavar="COLOR",
        help="a name, #rrggbb, R,G,B or R,G,B,A from 0 to 1, or none; by default light in studio light, else black",
    )
    group.add_argument("--threads", type=cli_types.count, metavar="N", help="threads to use; by default all")
    add_cluster_options(group)

    group = command.add_argument_group("light and colour")
    group.add_argument(
        "--light",
        choices=LIGHTS,
        help="by default studio: soft lights and shadows on a ground, tone mapped; phong with --lamp and --shadows",
    )
    group.add_argument(
        "--lamp",
        type=cli_types.lamp,
        action="append",
        metavar="SIDE",
        help="side that light comes from, as for --view, or the direction in which it travels, X,Y,Z or "
        "X,Y,Z,INTENSITY, as DirectionalLight; may be repeated; by default "
        "two that move with the camera, for path-trace a uniform sky",
    )
    group.add_argument("--shadows", action="store_true", help="surfaces cast shadows; for --light phong")
    group.add_argument(
        "--environment",
        metavar="SKY",
        type=cli_types.environment,
        help="for path-trace: a brightness, linear R,G,B, or an equirectangular .exr or .hdr",
    )
    add_environment(group)
    group.add_argument(
        "--color",
        type=color,
        action="append",
        metavar="COLOR",
        help="a name such as ivory, #rrggbb, or R,G,B from 0 to 1, sRGB; repeated, for each level and "
        "then for each mesh",
    )
    group.add_argument(
        "--opacity",
        type=float,
        action="append",
        metavar="A",
        help="0 to 1 (default 1); repeated, for each level and then for each mesh; not for path-trace",
    )
    add_silhouettes(group)
    add_ground(group, color)
    add_tone(group)
    add_materials(group)
    what = f"normal, depth, thickness, {', '.join(CURVATURES)}, a file with another volume or a mesh, or a store"
    group.add_argument("--color-by", metavar="WHAT", help=what)
    group.add_argument("--cmap", metavar="NAME", help="colour map of matplotlib for --color-by")
    group.add_argument(
        "--limits", type=cli_types.numbers(2), metavar="A,B", help="values of the first and the last colour of --cmap"
    )
    group.add_argument(
        "--exponent",
        type=float,
        metavar="N",
        help="of --light outline; the larger, the thinner its lines (default 2)",
    )

    add_limits(command)
    add_store_options(command)

    group = command.add_argument_group("layers of an .exr")
    group.add_argument(
        "--layers",
        type=cli_types.layers,
        default=(),
        metavar="NAME,NAME",
        help=f"layers to store besides colour: {', '.join(LAYERS)}; direct and variance for path-trace only",
    )
    group.add_argument(
        "--ambient-occlusion-samples",
        type=int,
        metavar="N",
        help="rays per pixel for ambient_occlusion (default 16)",
    )
    return parser


def _add_spline(group, degrees):
    group.add_argument("--degree", type=int, choices=degrees, help="of the spline (default 2)")
    group.add_argument(
        "--boundary", choices=("mirror", "periodic"), help="how samples continue outside (default mirror)"
    )
    group.add_argument(
        "--filter",
        choices=("interpolate", "none", "smoothing"),
        help="pass through the samples (default), use them as coefficients, or smooth them",
    )
    group.add_argument("--smoothing", type=float, metavar="WEIGHT", help="of the roughness, for --filter smoothing")


def _add_model(group):
    _add_spline(group, (1, 2, 3))
    add_inside(group)
    add_largest(group, _LARGEST)


def _add_cuts(command, closes=False):
    """Options of cuts; `closes` is whether solids are closed if nothing is said."""
    group = command.add_argument_group("cuts")
    group.add_argument(
        "--clip",
        type=cli_types.numbers(6),
        action="append",
        metavar="X,Y,Z,NX,NY,NZ",
        default=[],
        help="keep the side of a plane, through a point, that its normal points to; may be repeated",
    )
    group.add_argument(
        "--clip-box",
        type=cli_types.numbers(6),
        action="append",
        metavar="X,Y,Z,X,Y,Z",
        default=[],
        help="keep the inside of a box between two corners; may be repeated",
    )
    capped, closed = "close the solid where it is cut", "close the solid at the border of the volume"
    if closes:
        capped += " (default); --color-by the volume itself shows its values there"
        group.add_argument("--capped", action=argparse.BooleanOptionalAction, default=True, help=capped)
        group.add_argument("--closed", action=argparse.BooleanOptionalAction, default=True, help=closed + " (default)")
    else:
        group.add_argument("--capped", action="store_true", help=capped)
        group.add_argument("--closed", action="store_true", help=closed)


def _add_view(command, view):
    command.add_argument(
        "files", metavar="FILE", nargs="*", help="volumes, meshes (by their suffix), stores, and folders of slices"
    )
    command.set_defaults(run=view)
    command.add_argument(
        "-l",
        "--level",
        type=float,
        action="append",
        help=f"of every volume; may be repeated; {_LEVEL}",
    )
    add_largest(command, "all; without --level, all but specks, plates, and what is not the body")
    command.add_argument("--session", metavar="FILE", help="a session saved by the viewer, to continue")
    command.add_argument("--degree", type=int, choices=(1, 2, 3), help="of the spline (default 2)")
    _add_reading(command)
    group = command.add_argument_group("page")
    group.add_argument("--no-browser", action="store_true", help="only print the address")
    group.add_argument("--port", type=int, default=0, help="to listen on; by default any free port")
    group.add_argument(
        "--host",
        default="127.0.0.1",
        metavar="ADDRESS",
        help="to listen on (default 127.0.0.1, this machine alone)",
    )
    group.add_argument(
        "--token",
        help="what browsers must know to connect, in place of a random text; other users can read it in the list of "
        "processes, but not in the environment variable ISOSPLINE_TOKEN",
    )
    group.add_argument(
        "--upload-limit",
        default="8GB",
        metavar="SIZE",
        help="the most bytes of all uploaded files together (default 8GB)",
    )
    group.add_argument(
        "--upload-count",
        type=cli_types.count,
        default=10_000,
        metavar="N",
        help="the largest number of uploaded files (default 10000)",
    )
    group.add_argument("--threads", type=cli_types.count, metavar="N", help="threads to use; by default all")


def _add_input(command, optional=False):
    command.add_argument(
        "file",
        metavar="FILE",
        nargs="?" if optional else None,
        help="a volume, a folder with a DICOM series or TIFF slices, or a store",
    )
    _add_reading(command)


def _add_reading(command):
    group = command.add_argument_group("file")
    group.add_argument("--spacing", type=cli_types.numbers(3), metavar="X,Y,Z", help="instead of the file's")
    group.add_argument("--shape", type=cli_types.counts, metavar="X,Y,Z", help="samples of a raw file, x fastest")
    group.add_argument("--dtype", type=cli_types.dtype, metavar="TYPE", help="of raw samples, such as uint16")
    group.add_argument("--big-endian", action="store_true", help="raw samples have their high byte first")
    group.add_argument("--offset", type=int, metavar="BYTES", help="before the samples of a raw file")
    group.add_argument("--name", help="the array of a VTK file, or the UID of a DICOM series, to read")
    group.add_argument("--nan", type=float, metavar="VALUE", help="number in place of samples that are NaN")


def join_negative(arguments):
    """Join `--view -x` and `--spacing -1,2,3` with '=': argparse treats words that begin with a minus as options."""
    joined: list[str] = []
    for argument in arguments:
        is_value = re.fullmatch(r"-([xyz]|(\.?\d|inf)[-+\d.,eEinf]*)", argument)
        if is_value and joined and re.fullmatch(r"--[a-z-]+|-l", joined[-1]):
            joined[-1] += ("=" if joined[-1].startswith("--") else "") + argument
        else:
            joined.append(argument)
    return joined
