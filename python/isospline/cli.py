"""The command line: ``isospline info``, ``view``, ``measure``, ``mesh`` and ``render FILE``."""

from __future__ import annotations

import contextlib
import json
import os
import re
import shutil
import sys
import time
import warnings

import isospline

from .cli_parser import BAD_INPUT, join_negative, make_parser
from .cli_view import serve, session_image
from .interop.mesh_output import MESHES
from .looks import looks

#: Suffixes of the pictures and the videos that can be written.
PICTURES, VIDEOS = (".exr", ".png"), (".mp4",)

# Exit codes, besides 0 and that for bad input.
FAILED, INTERRUPTED = 1, 130


def main(argv=None):
    """Run the command line; returns the exit code. Errors are one line on the standard error stream."""
    with warnings.catch_warnings():
        warnings.simplefilter("always", UserWarning)
        warnings.showwarning = lambda message, *_, **__: _say(f"warning: {message}")
        try:
            given = join_negative(sys.argv[1:] if argv is None else argv)
            arguments = make_parser(info, measure, render, mesh, view).parse_args(given)
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


def measure(arguments):
    """Tell volume, area and curvature of an isosurface."""
    from .summary import describe_measures

    clip = _clip(arguments)
    data = _read(arguments)
    level = _suggested_level(data, arguments.file) if arguments.level is None else arguments.level
    volume = _volume(data, arguments)
    surface = isospline.Isosurface(volume, level, clip=clip, capped=arguments.capped, inside=arguments.inside)
    names = ["enclosed_volume", "area"]
    names += ["mean_curvature", "gaussian_curvature"] if volume.degree > 1 else []
    found = {}
    for name in names:
        with _progress(name.replace("_", " "), arguments) as progress:
            found[name] = getattr(surface, name)(order=arguments.order, progress=progress)
    if arguments.json:
        numbers = {name: {"value": each.value, "error": each.error} for name, each in found.items()}
        print(json.dumps({"path": str(arguments.file), "level": level, **numbers}, indent=2))
    else:
        print(describe_measures(arguments.file, level, found))


def render(arguments):
    """Read a volume, and write a picture, or pictures from all around, of isosurfaces of it and of meshes."""
    begin = time.perf_counter()
    _check_output(arguments)
    if (arguments.file is None) == (arguments.session is None):
        raise ValueError(f"FILE: expected either a file or --session, got {'both' if arguments.file else 'none'}")
    if arguments.threads:
        isospline.set_thread_count(arguments.threads)
    if arguments.session:
        with _progress("rendering", arguments) as progress:
            image = session_image(arguments, progress)
        written = _write(arguments, [image])
        print(f"{arguments.output}: {written}, {time.perf_counter() - begin:.1f} s")
        return
    look, lights = looks(arguments, len(arguments.level or [None]) + len(arguments.mesh))
    clip = _clip(arguments)
    if arguments.denoise:
        isospline.image.denoiser()  # is missed now and not after the work
    meshes = [isospline.read_mesh(path) for path in arguments.mesh]
    data = _read(arguments)
    levels = arguments.level or [_suggested_level(data, arguments.file)]

    volume = _volume(data, arguments)
    with _progress("finding cells", arguments) as progress:
        first = isospline.Isosurface(
            volume, levels[0], prune_depth=arguments.prune_depth, clip=clip, capped=arguments.capped,
            method=arguments.method, inside=arguments.inside, progress=progress,
        )  # fmt: skip
        surfaces = [first, *(first.with_level(level) for level in levels[1:])]
    scene = isospline.Scene([*surfaces, *meshes])
    cells = sum(surface.shell.count for surface in surfaces)
    look = dict(zip(scene.ids, look))
    if lights:
        look = {"integrator": isospline.PathTracer(materials=look, lights=lights)}
    else:
        look = {"shading": look}
    cameras = _cameras(arguments, scene if cells or meshes else volume)
    with _progress("rendering", arguments) as progress:
        written = _write(arguments, _images(scene, cameras, look, arguments, progress))
    print(f"{arguments.output}: {written}, {cells} cells, {time.perf_counter() - begin:.1f} s")


def mesh(arguments):
    """Read a volume, and write a mesh of an isosurface of it."""
    begin = time.perf_counter()
    if not arguments.output.lower().endswith(MESHES):
        raise ValueError(f"{arguments.output}: expected a name that ends in {', '.join(MESHES)}")
    _check_folder(arguments.output)
    if arguments.threads:
        isospline.set_thread_count(arguments.threads)
    clip = _clip(arguments)
    data = _read(arguments)
    level = _suggested_level(data, arguments.file) if arguments.level is None else arguments.level
    volume = _volume(data, arguments)
    surface = isospline.Isosurface(volume, level, clip=clip, capped=arguments.capped, inside=arguments.inside)
    with _progress("meshing", arguments) as progress:
        if arguments.tolerance is None:
            made, distance = surface.to_mesh(progress=progress), ""
        else:
            made, distance = surface.to_mesh(arguments.tolerance, return_distance=True, progress=progress)
            distance = f" at most {distance:.3g} from the surface,"
    try:
        made.write(arguments.output)
    except OSError as error:
        raise RuntimeError(_text(error)) from error
    print(f"{arguments.output}: {made!r},{distance} {time.perf_counter() - begin:.1f} s")


def _volume(data, arguments):
    """The model that the options tell of."""
    with _progress("filtering", arguments) as progress:
        return data.to_volume(
            degree=arguments.degree, boundary=arguments.boundary, filter=arguments.filter,
            smoothing=arguments.smoothing, progress=progress,
        )  # fmt: skip


def view(arguments):
    """Show files in the browser until Ctrl-C."""
    serve(arguments, _reading(arguments), _say)


def _clip(arguments):
    """The half-spaces and boxes that cut the surfaces."""
    clip = [isospline.HalfSpace(numbers[:3], numbers[3:]) for numbers in arguments.clip]
    clip += [isospline.Box(numbers[:3], numbers[3:]) for numbers in arguments.clip_box]
    if arguments.capped and not clip:
        raise ValueError("--capped: expected --clip or --clip-box beside it, got none")
    return clip


def _suggested_level(data, path):
    suggested = isospline.suggest_levels(data.data)
    if not suggested:
        raise ValueError(f"{path}: expected samples that differ, all of them are {data.data.flat[0]}")
    _say(f"level {suggested[0]:g}, the first one of those suggested: {', '.join(f'{each:g}' for each in suggested)}")
    return suggested[0]


def _cameras(arguments, seen):
    """The camera of the picture, or those of all pictures."""
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
    return cameras


def _images(scene, cameras, look, arguments, progress):
    """Render from one camera after the other."""
    samples = arguments.samples
    if samples is None:
        samples = 64 if arguments.shading == "path-trace" else 4
    for number, camera in enumerate(cameras):

        def report(fraction, done=number):
            return progress((done + fraction) / len(cameras))

        image = isospline.render(
            scene, camera, size=arguments.size, background=arguments.background, samples=samples,
            layers=arguments.layers, ambient_occlusion_samples=arguments.ambient_occlusion_samples,
            progress=progress and report, **look,
        )  # fmt: skip
        yield image.denoise() if arguments.denoise else image


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
    """The volume that the options tell of."""
    return isospline.read_volume(arguments.file, **_reading(arguments))


def _reading(arguments):
    """Options of `read_volume`. On the command line all is in the order x, y, z."""
    shape = arguments.shape and arguments.shape[::-1]
    dtype = arguments.dtype
    if arguments.big_endian:
        if dtype is None:
            raise ValueError("--big-endian: expected the type of raw samples, --dtype, beside it")
        dtype = dtype.newbyteorder(">")
    return dict(shape=shape, dtype=dtype, offset=arguments.offset, spacing=arguments.spacing, name=arguments.name)


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
    if arguments.layers and not path.lower().endswith(".exr"):
        raise ValueError(f"--layers: expected the name of a picture that has layers, which ends in .exr, got {path}")
    traced = {"direct", "variance"} & set(arguments.layers)
    if traced and arguments.shading != "path-trace":
        raise ValueError(f"--layers: expected {min(traced)} with --shading path-trace only, got {arguments.shading}")
    _check_folder(path)


def _check_folder(path):
    """Find out whether a file can be written where the path leads."""
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
