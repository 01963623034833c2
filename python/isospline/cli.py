"""The command line: ``isospline info FILE`` and ``isospline render FILE -o OUT``."""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import re
import shutil
import sys
import time
import warnings

import isospline

#: Suffixes of the pictures and the videos that can be written.
PICTURES, VIDEOS = (".exr", ".png"), (".mp4",)

#: What --color-by takes beside a file, and the kinds of curvature.
CURVATURES = {f"{kind}-curvature": kind for kind in ("mean", "gaussian", "maximum", "minimum")}

# Exit codes, besides 0.
FAILED, BAD_INPUT, INTERRUPTED = 1, 2, 130


def main(argv=None):
    """Run the command line; returns the exit code. Errors are one line on the standard error stream."""
    with warnings.catch_warnings():
        warnings.simplefilter("always", UserWarning)
        warnings.showwarning = lambda message, *_, **__: _say(f"warning: {message}")
        try:
            arguments = _parser().parse_args(_join_negative(sys.argv[1:] if argv is None else argv))
            arguments.run(arguments)
            sys.stdout.flush()
            return 0
        except KeyboardInterrupt:
            _say("interrupted")
            return INTERRUPTED
        except BrokenPipeError:
            # Whoever reads the output has had enough; Python would complain about it at exit.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            return FAILED
        except (ValueError, TypeError, OSError) as error:
            _say(f"error: {_text(error)}")
            return BAD_INPUT
        except (MemoryError, ImportError, RuntimeError) as error:
            _say(f"error: {_text(error) or type(error).__name__}")
            return FAILED


def info(arguments):
    """Tell what is in a file."""
    from .summary import describe, summarize

    summary = summarize(_read(arguments), arguments.file)
    if arguments.json:
        print(json.dumps(summary, indent=2))
        return
    encoding = sys.stdout.encoding or "ascii"
    unicode = encoding.lower().startswith("utf")
    print(describe(summary, shutil.get_terminal_size().columns, unicode))


def render(arguments):
    """Read a volume, and write a picture, or pictures from all around, of one of its isosurfaces."""
    begin = time.perf_counter()
    _check_output(arguments)
    if arguments.threads:
        isospline.set_thread_count(arguments.threads)
    shading = _shading(arguments)
    data = _read(arguments)
    level = arguments.level
    if level is None:
        suggested = isospline.suggest_levels(data.data)
        if not suggested:
            raise ValueError(f"{arguments.file}: expected samples that differ, all of them are {data.data.flat[0]}")
        level = suggested[0]
        _say(f"level {level:g}, the first one of those suggested: {', '.join(f'{each:g}' for each in suggested)}")

    with _progress("filtering", arguments) as progress:
        volume = data.to_volume(
            degree=arguments.degree, boundary=arguments.boundary, filter=arguments.filter,
            smoothing=arguments.smoothing, progress=progress,
        )  # fmt: skip
    with _progress("finding cells", arguments) as progress:
        surface = isospline.Isosurface(
            volume, level, prune_depth=arguments.prune_depth, method=arguments.method, inside=arguments.inside,
            progress=progress,
        )  # fmt: skip
    scene = isospline.Scene([surface])
    seen = scene if surface.shell.count else volume
    framing = dict(
        view=arguments.view, up=arguments.up, projection=arguments.projection, field_of_view=arguments.field_of_view,
        size=arguments.size,
    )  # fmt: skip
    if arguments.turntable:
        cameras = isospline.turntable(seen, arguments.turntable, **framing)
    else:
        cameras = [isospline.camera_for(seen, **framing)]
    if arguments.aperture:
        if arguments.projection != "perspective":
            raise ValueError(f"--aperture: expected a perspective projection, got {arguments.projection}")
        cameras = [camera.with_lens(arguments.aperture, focus_distance=arguments.focus) for camera in cameras]
    with _progress("rendering", arguments) as progress:
        written = _write(arguments, _images(scene, cameras, shading, arguments, progress))
    print(f"{arguments.output}: {written}, {surface.shell.count} cells, {time.perf_counter() - begin:.1f} s")


def _images(scene, cameras, shading, arguments, progress):
    """Render from one camera after the other."""
    for number, camera in enumerate(cameras):

        def report(fraction, done=number):
            return progress((done + fraction) / len(cameras))

        yield isospline.render(
            scene, camera, size=arguments.size, shading=shading, background=arguments.background,
            samples=arguments.samples, curvature=arguments.curvature, progress=progress and report,
        )  # fmt: skip


def _write(arguments, images):
    """Write the picture, the pictures or the video that the output's name asks for; tells what it was."""
    output = arguments.output
    try:
        if not arguments.turntable:
            (image,) = images
            image.write(output)
            return repr(image)
        if output.lower().endswith(VIDEOS):
            isospline.write_video(output, images, fps=arguments.fps)
        else:
            for number, image in enumerate(images):
                image.write(re.sub("#+", lambda hashes: f"{number:0{len(hashes[0])}d}", output))
    except OSError as error:
        raise RuntimeError(_text(error)) from error
    return f"{arguments.turntable} pictures of {arguments.size[0]} x {arguments.size[1]}"


def _read(arguments):
    """The volume that the options tell of. On the command line all is in the order x, y, z."""
    shape = arguments.shape and arguments.shape[::-1]
    dtype = arguments.dtype
    if arguments.big_endian:
        if dtype is None:
            raise ValueError("--big-endian: expected the type of raw samples, --dtype, beside it")
        dtype = dtype.newbyteorder(">")
    return isospline.read_volume(
        arguments.file, shape=shape, dtype=dtype, offset=arguments.offset, spacing=arguments.spacing,
        name=arguments.name,
    )  # fmt: skip


def _shading(arguments):
    color = _color_by(arguments)
    if arguments.shading == "outline":
        return isospline.Outline(arguments.exponent, surface_color=0 if color is None else color)
    return isospline.Phong(color=arguments.color if color is None else color)


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


def _check_output(arguments):
    """Find out before the work begins whether the output can be written."""
    path = arguments.output
    if arguments.turntable is not None:
        if arguments.turntable < 1:
            raise ValueError(f"--turntable: expected at least 1 picture, got {arguments.turntable}")
        numbered = len(re.findall("#+", os.path.basename(path))) == 1 and "#" not in os.path.dirname(path)
        if path.lower().endswith(VIDEOS):
            isospline.video.check(arguments.size, arguments.fps)
        elif not (numbered and path.lower().endswith(PICTURES)):
            expected = "that of a video, which ends in .mp4, or of pictures, with #### in place of their number"
            raise ValueError(f"{path}: expected {expected}, such as turn-####.png")
    elif not path.lower().endswith(PICTURES):
        videos = " (for a video, say --turntable)" if path.lower().endswith(VIDEOS) else ""
        raise ValueError(f"{path}: expected the name of a picture, which ends in {' or '.join(PICTURES)}{videos}")
    folder = os.path.dirname(os.path.abspath(path))
    if not os.path.isdir(folder):
        raise FileNotFoundError(f"{path}: expected a folder that exists, got {folder}")
    if os.path.isdir(path):
        raise IsADirectoryError(f"{path}: expected the name of a file, got that of a folder")
    if not os.access(folder, os.W_OK):
        raise PermissionError(f"{path}: expected a folder that can be written to, got {folder}")


@contextlib.contextmanager
def _progress(title, arguments):
    """A function that shows the finished fraction, on a terminal only; None where there is nothing to show."""
    if arguments.quiet or not sys.stderr.isatty():
        yield None
        return
    import tqdm

    layout = "{desc:<14}{percentage:3.0f}% |{bar}| {elapsed}"
    with tqdm.tqdm(total=1.0, desc=title, leave=False, file=sys.stderr, bar_format=layout) as bar:
        yield lambda fraction: bar.update(fraction - bar.n) and None


def _say(text):
    print(f"isospline: {text}", file=sys.stderr)


def _text(error):
    """One line that says what an error is about."""
    if isinstance(error, OSError) and error.strerror:
        text = f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    else:
        text = str(error)
    return " ".join(text.split())


# Arguments


class _Parser(argparse.ArgumentParser):
    """Says what is wrong in one line, as all errors are."""

    def error(self, message):
        _say(f"error: {message} (try {self.prog} --help)")
        raise SystemExit(BAD_INPUT)


def _parser():
    parser = _Parser(prog="isospline", description=isospline.__doc__)
    parser.add_argument("--version", action="version", version=f"isospline {isospline.__version__}")
    commands = parser.add_subparsers(metavar="COMMAND", required=True)

    command = commands.add_parser("info", help="tell size, place, range, histogram and suggested levels of a volume")
    _add_input(command)
    command.add_argument("--json", action="store_true", help="print JSON")
    command.set_defaults(run=info)

    command = commands.add_parser("render", help="make a picture of an isosurface")
    _add_input(command)
    command.add_argument("-o", "--output", required=True, metavar="OUT",
                         help="picture to write: .png or .exr; of a turntable .mp4 or, with numbers, turn-####.png")
    command.add_argument("-q", "--quiet", action="store_true", help="show no progress")
    command.set_defaults(run=render)

    group = command.add_argument_group("surface")
    group.add_argument("-l", "--level", type=float, help="value on the surface; by default the first suggested one")
    group.add_argument("--degree", type=int, choices=(1, 2, 3), default=2, help="of the spline (default 2)")
    group.add_argument("--boundary", choices=("mirror", "periodic"), default="mirror", help="how samples go on outside")
    group.add_argument("--filter", choices=("interpolate", "none", "smoothing"), default="interpolate",
                       help="pass through the samples (default), take them as coefficients, or smooth them")
    group.add_argument("--smoothing", type=float, default=0.0, metavar="WEIGHT", help="of --filter smoothing")
    group.add_argument("--inside", choices=("above", "below"), default="above", help="the solid side of the level")
    group.add_argument("--prune-depth", type=int, default=2, metavar="DEPTH", help="of the shell, 0 to 6 (default 2)")
    group.add_argument("--method", choices=("exact", "reference", "bracket"), default="exact", help="root finder")

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
    group.add_argument("--curvature", action="store_true", help="store the curvature in .exr, too")
    group.add_argument("--samples", type=int, default=4, metavar="N", help="rays of a pixel (default 4)")
    group.add_argument("--shading", choices=("phong", "outline"), default="phong")
    group.add_argument("--color", type=_numbers(3), default=(1.0, 1.0, 1.0), metavar="R,G,B", help="of Phong, linear")
    group.add_argument("--color-by", metavar="WHAT",
                       help=f"normal, depth, {', '.join(CURVATURES)}, or a file with another volume")
    group.add_argument("--cmap", metavar="NAME", help="colour map of matplotlib for --color-by")
    group.add_argument("--limits", type=_numbers(2), metavar="A,B", help="values of its first and last colour")
    group.add_argument("--exponent", type=float, default=2.0, metavar="N", help="of the outline (default 2)")
    group.add_argument("--background", type=_background, default=0.0, metavar="COLOR",
                       help="black (default), white, none, or linear R,G,B or R,G,B,A")
    group.add_argument("--threads", type=int, metavar="N", help="to use; by default all")
    return parser


def _add_input(command):
    command.add_argument("file", metavar="FILE", help="a volume, or a folder with a DICOM series or TIFF slices")
    group = command.add_argument_group("file")
    group.add_argument("--spacing", type=_numbers(3), metavar="X,Y,Z", help="instead of the file's")
    group.add_argument("--shape", type=_counts, metavar="X,Y,Z", help="samples of a raw file, x fastest")
    group.add_argument("--dtype", type=_dtype, metavar="TYPE", help="of raw samples, such as uint16")
    group.add_argument("--big-endian", action="store_true", help="raw samples have their high byte first")
    group.add_argument("--offset", type=int, default=0, metavar="BYTES", help="of raw samples in the file")
    group.add_argument("--name", help="the array of a VTK file, or the UID of a DICOM series, to read")


def _join_negative(arguments):
    """Join `--view -x` and `--spacing -1,2,3` with '=': argparse takes what begins with a minus for an option."""
    joined = []
    for argument in arguments:
        is_value = re.fullmatch(r"-([xyz]|\.?\d[-+\d.,e]*)", argument)
        if is_value and joined and re.fullmatch(r"--[a-z-]+|-l", joined[-1]):
            joined[-1] += ("=" if joined[-1].startswith("--") else "") + argument
        else:
            joined.append(argument)
    return joined


def _numbers(*counts):
    """A type of numbers with commas between them."""

    def parse(text):
        with contextlib.suppress(ValueError):
            numbers = tuple(float(part) for part in text.split(","))
            if len(numbers) in counts:
                return numbers
        raise argparse.ArgumentTypeError(f"expected {' or '.join(map(str, counts))} numbers with commas, got {text!r}")

    return parse


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


def _background(text):
    names = {"black": 0.0, "white": 1.0, "none": None}
    return names[text] if text in names else _numbers(3, 4)(text)


def _dtype(text):
    import numpy as np

    try:
        return np.dtype(text)
    except TypeError:
        raise argparse.ArgumentTypeError(f"expected a type such as uint8, int16 or float32, got {text!r}") from None
