"""The command line: ``isospline demo``, and ``info``, ``view``, ``measure``, ``mesh``, ``render FILE`` and others."""

from __future__ import annotations

import contextlib
import functools
import io
import json
import math
import os
import shutil
import sys
import time
import warnings

import numpy as np

import isospline

from ..base.progress import Bar, Lines
from ..base.views import DEFAULT_VIEW
from ..picture.pixels import denoiser
from ..picture.tone import check_exposure
from .cluster import cluster_images, wants_cluster
from .compare import run as run_compare
from .convert import run as run_convert
from .demo import make_demo
from .frames import render_frames
from .given import MODEL, READING, given, keywords, refuse_several_levels, refuse_without
from .interrupts import heard_interrupts
from .labels import given_labels, label_surfaces, measure_labels, opened_or_labels, recognized_labels, set_colors
from .levels import Chosen, choose_levels, make_surfaces, tell_of_open_borders
from .light_options import TONE, ground_look, looks
from .limits import check_limits, frames_to_make, traced_images
from .mesh import check_mesh_options, write_mesh
from .output import check_output
from .parser import BAD_INPUT, FAILED, INTERRUPTED, join_negative, make_parser
from .picture import announce_time, background_of, cameras_of, check_camera_options, marks_for
from .placement import read_placed
from .record import made_of
from .store import Store, finite, opened
from .units import in_one_unit, unit_transform
from .verify import run as run_verify
from .view import check_beside_session, serve, session_image
from .write import DISK_ERRORS, check_table, error_text, measured, write_images, write_measures


def _parser():
    return make_parser(demo, info, measure, compare, verify, render, mesh, view, convert)


def main(argv=None):
    """Run the command line; returns the exit code. Errors are one line on the standard error stream."""
    with warnings.catch_warnings(), heard_interrupts():
        warnings.simplefilter("always", UserWarning)
        warnings.simplefilter("ignore", DeprecationWarning)  # of other packages; some are UserWarnings as well
        warnings.showwarning = lambda message, *_, **__: _say(f"warning: {message}")
        if isinstance(sys.stdout, io.TextIOWrapper) and sys.stdout.errors == "strict":
            sys.stdout.reconfigure(errors="backslashreplace")  # as standard error, for terminals without Unicode
        try:
            typed = join_negative(sys.argv[1:] if argv is None else argv)
            refuse_several_levels(typed)
            arguments = _parser().parse_args(typed)
            arguments.run(arguments)
            sys.stdout.flush()
            return 0
        except KeyboardInterrupt:
            _say("interrupted")
            return INTERRUPTED
        except BrokenPipeError:
            # The reader of the output has closed it; without this, Python would report an error at exit.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            return FAILED
        except (ValueError, TypeError, OSError) as error:
            _say(f"error: {error_text(error)}")
            return FAILED if getattr(error, "errno", None) in DISK_ERRORS else BAD_INPUT
        except (MemoryError, ImportError, RuntimeError) as error:
            _say(f"error: {error_text(error) or type(error).__name__}")
            return FAILED


def demo(arguments):
    """Make a volume and a picture of it, and print what to try next."""
    print(make_demo(arguments.output, lambda title: _progress(title, arguments)))


def info(arguments):
    """Print a summary of a file."""
    from .summary import describe, summarize

    data, labels = opened_or_labels(arguments, _read, _reading)
    summary = (
        data.summary(arguments.file) if isinstance(data, Store) else summarize(data, arguments.file, labels=labels)
    )
    if arguments.json:
        print(json.dumps(summary, indent=2))
        return
    print(describe(summary, shutil.get_terminal_size().columns, _has_unicode()))


def measure(arguments):
    """Print the volume, area and curvature of isosurfaces."""
    from .summary import describe_measures

    clip = _clip(arguments)
    if arguments.output:
        check_table(arguments.output)
        if arguments.json:
            raise ValueError("--json cannot be combined with --output")
    data, labels = _volume_or_labels(arguments)
    if labels is not None:
        measure_labels(labels, arguments, _progress, _has_unicode())
        return
    chosen = choose_levels(data, arguments, _say)
    surfaces = _surfaces(_volume(data, arguments), chosen, clip, arguments)
    if arguments.output:
        write_measures(arguments, surfaces, _progress)
        return
    found_of = [measured(surface, arguments, _progress) for surface in surfaces]
    if arguments.json:
        parts = [
            {
                "path": str(arguments.file),
                "level": surface.level,
                "unit": surface.volume.unit,
                **{name: {"value": each.value, "error": each.error} for name, each in found.items()},
                "components": {name: array.tolist() for name, array in components.items()},
            }
            for surface, (found, components) in zip(surfaces, found_of)
        ]
        print(json.dumps(parts if len(parts) > 1 else parts[0], indent=2))
        return
    for surface, (found, components) in zip(surfaces, found_of):
        unit = surface.volume.unit
        print(describe_measures(arguments.file, surface.level, found, components, unit, _has_unicode()))


def compare(arguments):
    """Print the distances of an isosurface from a mesh or another isosurface."""
    run_compare(arguments, _read, _progress, _say, _has_unicode())


def verify(arguments):
    """Check the certificate of a ray against a volume."""
    run_verify(arguments, _read)


def _has_unicode():
    """Whether the output shows all of Unicode."""
    return (sys.stdout.encoding or "ascii").lower().startswith("utf")


def render(arguments):
    """Read a volume, and write a picture or a turntable of its isosurfaces and of meshes; or many, of many volumes."""
    if arguments.frames:
        render_frames(arguments, _render, _say)
    else:
        _render(arguments)


def _render(arguments, write=True):
    """Render one volume; returns the cameras and the levels, which is all that there is to do unless `write`."""
    begin = time.perf_counter()
    if arguments.session and arguments.file is None:
        check_beside_session(arguments, _parser())
    arguments.light = arguments.light or ("phong" if arguments.lamp or arguments.shadows else "studio")
    check_output(arguments)
    if (arguments.file is None) == (arguments.session is None):
        raise ValueError(f"FILE: expected either a file or --session, got {'both' if arguments.file else 'none'}")
    if arguments.threads:
        isospline.set_thread_count(arguments.threads)
    check_limits(arguments)
    check_camera_options(arguments)
    is_distributed = wants_cluster(arguments)
    if arguments.session:
        with _progress("rendering", arguments) as progress:
            image = session_image(arguments, progress)
        written = write_images(arguments, [0], [image])
        print(f"{arguments.output}: {written}, {time.perf_counter() - begin:.1f} s")
        return None
    if not (arguments.labels or arguments.label):
        looks(arguments, len(arguments.level or [None]) + len(arguments.mesh))  # fails now, and not after reading
    clip = _clip(arguments)
    # These fail now, and not after the work.
    check_exposure(arguments.exposure or 0.0)
    if arguments.denoise:
        denoiser()
    record_of = made_of(arguments)  # before the files are read: one that changes later is another one
    placed = [read_placed(text) for text in arguments.mesh]
    data, labels = _volume_or_labels(arguments)
    meshes = in_one_unit(placed, data.unit, arguments, _say)
    chosen = choose_levels(data, arguments, _say) if labels is None else Chosen([])
    if chosen.view.reason:
        arguments.view, arguments.up = chosen.view.view, chosen.view.up
    count = len(chosen.levels) + len(meshes) if labels is None else set_colors(labels, arguments)
    to_unit = functools.partial(unit_transform, data.unit, arguments, _say)
    materials, light_of = looks(arguments, count, to_unit)

    def make_scene(volume):
        with _progress("finding cells" if labels is None else "smoothing", arguments) as progress:
            options = dict(
                clip=clip, capped=arguments.capped and bool(clip), closed=arguments.closed, progress=progress
            )
            if labels is not None:
                surfaces = label_surfaces(labels, arguments, **options)
            else:
                surfaces = make_surfaces(volume, chosen, arguments, options, _say)
        return isospline.Scene([*surfaces, *meshes]), surfaces, volume

    def make_cameras(made):
        if arguments.cameras:
            return arguments.cameras
        scene, surfaces, volume = made
        is_empty = not meshes and not any(math.isfinite(surface.bounds[0, 0]) for surface in surfaces)
        marks = None if is_empty else marks_for(arguments, scene, look_of(scene))
        return cameras_of(arguments, volume, marks)

    def look_of(scene):
        return {"light": light_of(dict(zip(scene.ids, materials)))}

    if isinstance(data, Store):
        made, cameras, extent = data.scene_and_cameras(make_scene, make_cameras, arguments)
    else:
        made = make_scene(_volume(data, arguments) if labels is None else None)
        cameras = make_cameras(made)
        extent = f"{sum(surface.shell.count for surface in made[1])} cells"
    if not write:
        return cameras, chosen.levels
    scene = made[0]
    if arguments.ground:
        materials = [*materials, ground_look(arguments, materials)]
        scene.add(isospline.ground_for(scene, up=arguments.up or (0, 0, 1)))
    look = look_of(scene)
    marks = marks_for(arguments, scene, look)
    frames, missing = frames_to_make(cameras, arguments, record_of, _say)
    with _progress("rendering", arguments) as progress:
        written = write_images(
            arguments, frames, _images(scene, missing, look, marks, is_distributed, arguments, progress), record_of
        )
    if not (arguments.level or data.patient or arguments.up or arguments.view != DEFAULT_VIEW):
        _say("z is upwards, as the file has no patient directions; --up -z turns the picture, --view back the eye")
    print(f"{arguments.output}: {written}, {extent}, {time.perf_counter() - begin:.1f} s")
    return cameras, chosen.levels


def mesh(arguments):
    """Read a volume, and write a mesh of an isosurface of it."""
    begin = time.perf_counter()
    check_mesh_options(arguments)
    if arguments.threads:
        isospline.set_thread_count(arguments.threads)
    clip = _clip(arguments)
    data = opened(arguments, _read)
    chosen = choose_levels(data, arguments, _say)
    if arguments.for_print:
        chosen = chosen._replace(without_specks=False)  # only the largest piece will be kept
    (surface,) = _surfaces(_volume(data, arguments), chosen, clip, arguments)
    with _progress("meshing", arguments) as progress:
        said = write_mesh(surface, arguments, progress)
    print(f"{arguments.output}: {said}, {time.perf_counter() - begin:.1f} s")


def _surfaces(volume, chosen, clip, arguments):
    """The isosurfaces that the options specify."""
    with _progress("finding cells", arguments) as progress:
        options = dict(
            clip=clip,
            capped=arguments.capped,
            closed=arguments.closed,
            progress=progress,
        )
        surfaces = make_surfaces(volume, chosen, arguments, options, _say)
    tell_of_open_borders(surfaces, _say)
    return surfaces


def _volume(data, arguments):
    """The model that the options specify."""
    with _progress("filtering", arguments) as progress:
        return data.to_volume(**keywords(arguments, MODEL), progress=progress)


def view(arguments):
    """Show files in the browser until Ctrl-C."""
    serve(arguments, _reading(arguments), _say)


def convert(arguments):
    """Write a store of a volume of any size."""
    with _progress("converting", arguments) as progress:
        run_convert(arguments, _reading(arguments), progress, _say)


def _part(option, kind, numbers):
    """The part that two points of an option stand for."""
    try:
        return kind(numbers[:3], numbers[3:])
    except ValueError as error:
        raise ValueError(f"{option}: {error}") from None


def _clip(arguments):
    """The half-spaces and boxes that cut the surfaces."""
    clip: list[isospline.HalfSpace | isospline.Box]
    clip = [_part("--clip", isospline.HalfSpace, numbers) for numbers in arguments.clip]
    clip += [_part("--clip-box", isospline.Box, numbers) for numbers in arguments.clip_box]
    if not (arguments.capped or clip) and arguments.run is render:  # where it is the default
        raise ValueError("--no-capped: expected --clip or --clip-box with it, got none")
    if arguments.capped and not (clip or arguments.closed) and arguments.run is not render:
        raise ValueError("--capped: expected --clip or --clip-box, or --closed for the volume's border, got none")
    return clip


def _images(scene, cameras, look, marks, is_distributed, arguments, progress):
    """Render from one camera after the other."""
    is_mapped = given(arguments, TONE)
    options = dict(
        size=arguments.size,
        background=None if is_mapped else background_of(arguments),
        layers=arguments.layers,
        **keywords(arguments, ["ambient_occlusion_samples"]),
        **look,
    )
    samples = 4 if arguments.samples is None else arguments.samples
    is_path_traced = isinstance(look["light"], isospline.PathTracer)
    progress = progress or (lambda fraction: None)
    if is_distributed:
        from_cluster = cluster_images(scene, cameras, {"samples": samples, **options}, arguments, progress)
    elif not is_path_traced and not arguments.quiet:
        announce_time(scene, cameras[0], len(cameras), {"samples": samples, **options}, _say)
    for number, camera in enumerate(cameras):

        def report(fraction, done=number):
            return progress((done + fraction) / len(cameras))

        if is_distributed:
            images = [next(from_cluster)]
        elif is_path_traced:
            renderer = isospline.ProgressiveRenderer(scene, camera, **options)
            images = traced_images(renderer, arguments, report, _say)
        else:
            images = [isospline.render(scene, camera, samples=samples, progress=report, **options)]
        for image in images:
            image = image.denoise() if arguments.denoise else image
            if is_mapped:
                image = image.tone_map(arguments.tone_map or "linear", exposure=arguments.exposure or 0.0)
                image = image.over(background_of(arguments))
            yield marks.draw(image, camera, is_fitted=not arguments.cameras)


def _volume_or_labels(arguments):
    """The volume or the store of a file; or its volume and label map, if it is one and no level is given."""
    reading = _reading(arguments)
    labels = given_labels(arguments, reading)
    if labels is not None:
        return labels.source, labels
    data = opened(arguments, _read)
    return data, recognized_labels(data, arguments, reading, _say)


def _read(arguments):
    """The volume that the options specify."""
    volume = isospline.read_volume(arguments.file, **_reading(arguments))
    return finite(volume, arguments.file, "; --nan VALUE replaces NaN")


def _reading(arguments):
    """Options of `read_volume`. On the command line, everything is in the order x, y, z."""
    reading = keywords(arguments, READING)
    if "shape" in reading:
        reading["shape"] = reading["shape"][::-1]
    if "dtype" not in reading:
        refuse_without(arguments, ["big_endian"], "--dtype")
    elif arguments.big_endian:
        if reading["dtype"].startswith("<"):
            refuse_without(arguments, ["big_endian"], "a --dtype that is not little-endian", reading["dtype"])
        reading["dtype"] = np.dtype(reading["dtype"]).newbyteorder(">")
    return reading


@contextlib.contextmanager
def _progress(title, arguments):
    """A function that shows the finished fraction; None if there is nothing to show."""
    if arguments.quiet:
        yield None
        return
    shown = Bar(title, leave=False) if sys.stderr.isatty() else Lines(title)
    try:
        yield shown
    finally:
        shown.close()


def _say(text):
    print(f"isospline: {text}", file=sys.stderr)
