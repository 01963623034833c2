"""The options of the command line."""

from __future__ import annotations

import argparse
import contextlib
import re

import isospline

from ._core import LAYERS
from .cameras import VIEWS
from .looks import CURVATURES, SHADINGS

#: The exit code for bad arguments and files.
BAD_INPUT = 2


class _Parser(argparse.ArgumentParser):
    """Says what is wrong in one line, as all errors are."""

    def error(self, message):
        self.exit(BAD_INPUT, f"isospline: error: {message} (try {self.prog} --help)\n")


def make_parser(info, measure, render, mesh, view):
    """The parser of the command line; its arguments are what the commands call."""
    parser = _Parser(prog="isospline", description=isospline.__doc__)
    parser.add_argument("--version", action="version", version=f"isospline {isospline.__version__}")
    commands = parser.add_subparsers(metavar="COMMAND", required=True)

    command = commands.add_parser("info", help="tell size, place, range, histogram and suggested levels of a volume")
    _add_input(command)
    command.add_argument("--json", action="store_true", help="print JSON")
    command.set_defaults(run=info)

    command = commands.add_parser("mesh", help="write the triangle mesh of an isosurface")
    _add_input(command)
    command.add_argument("-o", "--output", required=True, metavar="OUT",
                         help="mesh to write: .stl, .ply, .obj or .glb")
    command.add_argument("-q", "--quiet", action="store_true", help="show no progress")
    command.set_defaults(run=mesh)
    group = command.add_argument_group("surface")
    group.add_argument("-l", "--level", type=float, help="value on the surface; by default the first suggested one")
    group.add_argument("--tolerance", type=float, metavar="DISTANCE",
                       help="largest distance between surface and mesh, world units: as few triangles as that takes; "
                            "by default a vertex on every edge of a cell that the surface crosses")
    _add_model(group)
    group.add_argument("--threads", type=int, metavar="N", help="to use; by default all")
    _add_clip(command, "close the solid where it is cut")

    command = commands.add_parser("measure", help="tell volume, area and curvature of an isosurface")
    _add_input(command)
    command.add_argument("-q", "--quiet", action="store_true", help="show no progress")
    command.add_argument("--json", action="store_true", help="print JSON")
    command.add_argument("--order", type=int, default=4, metavar="N", help="nodes of quadrature, 2 to 10 (default 4)")
    command.set_defaults(run=measure)
    group = command.add_argument_group("surface")
    group.add_argument("-l", "--level", type=float, help="value on the surface; by default the first suggested one")
    _add_model(group)
    _add_clip(command, "close the solid where it is cut")

    _add_view(commands.add_parser("view", help="show volumes and meshes in the browser"), view)

    command = commands.add_parser("render", help="make a picture of isosurfaces and meshes")
    _add_input(command, optional=True)
    command.add_argument("--session", metavar="FILE",
                         help="what the viewer saved, in place of FILE and options of surfaces, cuts, view, light")
    command.add_argument("-o", "--output", required=True, metavar="OUT",
                         help="picture to write: .png or .exr; of a turntable .mp4 or, with numbers, turn-####.png")
    command.add_argument("-q", "--quiet", action="store_true", help="show no progress")
    command.set_defaults(run=render)

    group = command.add_argument_group("surfaces")
    group.add_argument("-l", "--level", type=float, action="append",
                       help="value on the surface, of each one if repeated; by default the first suggested one")
    group.add_argument("--mesh", action="append", metavar="FILE", default=[],
                       help="triangles to show as well, in the volume's world; may be repeated")
    _add_model(group)
    group.add_argument("--prune-depth", type=int, default=2, metavar="DEPTH", help="of the shell, 0 to 6 (default 2)")
    group.add_argument("--method", choices=("exact", "reference", "bracket"), default="exact", help="root finder")

    _add_clip(command, "close the solid where it is cut; --color-by the volume itself shows its values there")

    group = command.add_argument_group("picture")
    group.add_argument("--size", type=_size, default=(640, 480), metavar="WxH", help="in pixels (default 640x480)")
    group.add_argument("--view", type=_view, default="iso", metavar="SIDE",
                       help="side of the eye: front, back, left, right, top, bottom, iso (default), +x to -z, X,Y,Z")
    group.add_argument("--up", type=_numbers(3), metavar="X,Y,Z", help="what is upwards in the picture")
    group.add_argument("--projection", choices=("perspective", "orthographic"), default="perspective")
    group.add_argument("--field-of-view", type=float, default=30.0, metavar="DEGREES", help="vertical (default 30)")
    group.add_argument("--turntable", type=int, metavar="N", help="N pictures, or a video of them, from all around")
    group.add_argument("--fps", type=float, default=30.0, metavar="N", help="pictures of a video a second (default 30)")
    group.add_argument("--aperture", type=float, metavar="RADIUS", help="of a lens, for depth of field; world units")
    group.add_argument("--focus", type=float, metavar="DISTANCE", help="of what is sharp; by default the middle")
    group.add_argument("--samples", type=int, metavar="N", help="rays of a pixel (default 4, path-trace 64)")
    group.add_argument("--denoise", action="store_true", help="take out the noise of --shading path-trace")
    group.add_argument("--background", type=_background, default=0.0, metavar="COLOR",
                       help="black (default), white, none, or linear R,G,B or R,G,B,A")
    group.add_argument("--threads", type=int, metavar="N", help="to use; by default all")

    group = command.add_argument_group("light and colour")
    group.add_argument("--shading", choices=SHADINGS, default="phong", help="what light does (default phong)")
    group.add_argument("--light", type=_light, action="append", metavar="SIDE",
                       help="side that light comes from, as of --view, or X,Y,Z,INTENSITY; may be repeated; by default "
                            "two that go with the camera, for path-trace an even sky")
    group.add_argument("--shadows", action="store_true", help="hide the lights of phong behind what is before them")
    group.add_argument("--environment", metavar="SKY", type=_environment,
                       help="of path-trace: a brightness, linear R,G,B, or an equirectangular .exr")
    group.add_argument("--color", type=_numbers(3), action="append", metavar="R,G,B",
                       help="linear; repeated, of each level and then of each mesh")
    group.add_argument("--opacity", type=float, action="append", metavar="A",
                       help="0 to 1 (default 1); repeated, of each level and then of each mesh; not for path-trace")
    group.add_argument("--color-by", metavar="WHAT",
                       help=f"normal, depth, {', '.join(CURVATURES)}, or a file with another volume")
    group.add_argument("--cmap", metavar="NAME", help="colour map of matplotlib for --color-by")
    group.add_argument("--limits", type=_numbers(2), metavar="A,B", help="values of its first and last colour")
    group.add_argument("--exponent", type=float, default=2.0, metavar="N", help="of outline (default 2)")

    group = command.add_argument_group("layers of an .exr")
    group.add_argument("--layers", type=_layers, default=(), metavar="NAME,NAME",
                       help=f"what to store beside colour: {', '.join(LAYERS)}; direct and variance of path-trace")
    group.add_argument("--ambient-occlusion-samples", type=int, default=16, metavar="N",
                       help="rays that ambient_occlusion is the mean of (default 16)")
    return parser


def _add_model(group):
    group.add_argument("--degree", type=int, choices=(1, 2, 3), default=2, help="of the spline (default 2)")
    group.add_argument("--boundary", choices=("mirror", "periodic"), default="mirror", help="how samples go on outside")
    group.add_argument("--filter", choices=("interpolate", "none", "smoothing"), default="interpolate",
                       help="pass through the samples (default), take them as coefficients, or smooth them")
    group.add_argument("--smoothing", type=float, default=0.0, metavar="WEIGHT", help="of --filter smoothing")
    group.add_argument("--inside", choices=("above", "below"), default="above", help="the solid side of the level")


def _add_clip(command, capped_help):
    group = command.add_argument_group("cuts")
    group.add_argument("--clip", type=_numbers(6), action="append", metavar="X,Y,Z,NX,NY,NZ", default=[],
                       help="keep what is on the side of a plane, through a point, that its normal points to; may be "
                            "repeated")
    group.add_argument("--clip-box", type=_numbers(6), action="append", metavar="X,Y,Z,X,Y,Z", default=[],
                       help="keep what is in a box between two corners; may be repeated")
    group.add_argument("--capped", action="store_true", help=capped_help)


def _add_view(command, view):
    command.add_argument("files", metavar="FILE", nargs="*",
                         help="volumes, by their suffix meshes, and folders of slices")
    command.set_defaults(run=view)
    command.add_argument("-l", "--level", type=float, action="append",
                         help="of every volume; may be repeated; by default the first suggested one")
    command.add_argument("--session", metavar="FILE", help="what the viewer saved, to go on with")
    command.add_argument("--degree", type=int, choices=(1, 2, 3), default=2, help="of the spline (default 2)")
    _add_reading(command)
    group = command.add_argument_group("page")
    group.add_argument("--no-browser", action="store_true", help="only print the address")
    group.add_argument("--port", type=int, default=0, help="to listen on; by default any that is free")
    group.add_argument("--host", default="127.0.0.1", metavar="ADDRESS",
                       help="to listen on (default 127.0.0.1, this machine alone); elsewhere the page wants the token "
                            "in the address that is printed")
    group.add_argument("--threads", type=int, metavar="N", help="to use; by default all")


def _add_input(command, optional=False):
    command.add_argument("file", metavar="FILE", nargs="?" if optional else None,
                         help="a volume, or a folder with a DICOM series or TIFF slices")
    _add_reading(command)


def _add_reading(command):
    group = command.add_argument_group("file")
    group.add_argument("--spacing", type=_numbers(3), metavar="X,Y,Z", help="instead of the file's")
    group.add_argument("--shape", type=_counts, metavar="X,Y,Z", help="samples of a raw file, x fastest")
    group.add_argument("--dtype", type=_dtype, metavar="TYPE", help="of raw samples, such as uint16")
    group.add_argument("--big-endian", action="store_true", help="raw samples have their high byte first")
    group.add_argument("--offset", type=int, default=0, metavar="BYTES", help="of raw samples in the file")
    group.add_argument("--name", help="the array of a VTK file, or the UID of a DICOM series, to read")


def join_negative(arguments):
    """Join `--view -x` and `--spacing -1,2,3` with '=': argparse takes what begins with a minus for an option."""
    joined = []
    for argument in arguments:
        is_value = re.fullmatch(r"-([xyz]|\.?\d[-+\d.,e]*)", argument)
        if is_value and joined and re.fullmatch(r"--[a-z-]+|-l", joined[-1]):
            joined[-1] += ("=" if joined[-1].startswith("--") else "") + argument
        else:
            joined.append(argument)
    return joined


def _numbers(*counts, instead=""):
    """A type of numbers with commas between them; `instead` says what else there could be."""
    expected = f"{' or '.join(map(str, counts))} numbers with commas" + (instead and f" or {instead}")

    def parse(text):
        with contextlib.suppress(ValueError):
            numbers = tuple(float(part) for part in text.split(","))
            if len(numbers) in counts:
                return numbers
        raise argparse.ArgumentTypeError(f"expected {expected}, got {text!r}")

    return parse


def _layers(text):
    names = tuple(text.split(","))
    unknown = [name for name in names if name not in LAYERS]
    if unknown:
        raise argparse.ArgumentTypeError(f"expected names among {', '.join(LAYERS)}, got {unknown[0]!r}")
    return names


def _counts(text):
    match = re.fullmatch(r"(\d+)[x,](\d+)[x,](\d+)", text)
    if not match:
        raise argparse.ArgumentTypeError(f"expected three counts such as 128,256,256, got {text!r}")
    return tuple(map(int, match.groups()))


def _size(text):
    match = re.fullmatch(r"(\d+)[x,](\d+)", text)
    if not match:
        raise argparse.ArgumentTypeError(f"expected a width and a height such as 640x480, got {text!r}")
    return tuple(map(int, match.groups()))


def _view(text):
    return text if re.fullmatch(r"[-+]?[a-z]+", text) else _numbers(3)(text)


def _light(text):
    return VIEWS[text][0] if text in VIEWS else _numbers(3, 4, instead=f"one of {', '.join(VIEWS)}")(text)


def _environment(text):
    """One number or three, or the name of a file."""
    return text if text.lower().endswith(".exr") else _numbers(1, 3, instead="a file that ends in .exr")(text)


def _background(text):
    names = {"black": 0.0, "white": 1.0, "none": None}
    return names[text] if text in names else _numbers(3, 4)(text)


def _dtype(text):
    import numpy as np

    try:
        return np.dtype(text)
    except TypeError:
        raise argparse.ArgumentTypeError(f"expected a type such as uint8, int16 or float32, got {text!r}") from None
