"""Options of ``isospline render`` whose defaults give good pictures."""

from __future__ import annotations

import argparse
import contextlib
import functools
import time
from typing import Any

import isospline

from ..base.views import DEFAULT_VIEW
from ..colors import color_of, named_color
from ..levels import count_pieces
from ..picture.annotations import ANNOTATIONS, check_annotations, shown_looks
from ..picture.cameras import camera_for, turntable_cameras
from ..picture.lights import resolve
from ..picture.marks import Marks, unit_of
from .given import keywords, refuse_without
from .types import floats

#: The user is told how long pictures take if it is this many seconds or more.
LONG = 3.0
# The small picture that is timed has this many times fewer pixels along each side.
_SMALLER = 8
#: The value of --largest that keeps all components.
ALL = "all"


def add_picture_options(group):
    """Add the options of the argument group "picture"."""
    group.add_argument(
        "--fast", action="store_true", help="leave out shadows, sky and ground; takes about a tenth of the time"
    )
    group.add_argument("--denoise", action="store_true", help="remove the noise of path tracing by Open Image Denoise")
    group.add_argument(
        "--annotate",
        type=_annotations,
        nargs="?",
        const=True,
        metavar="MARKS",
        help="draw scale-bar, colorbar, both with a comma, or none; without a value, all that apply; by default a "
        "scale bar in a .png or a video if the unit is known",
    )


def add_inside(group):
    """Add the option for the solid side of the level."""
    group.add_argument("--inside", choices=("above", "below"), help="the solid side of the level (default above)")


def add_largest(group, default):
    """Add the option for the number of components to keep."""
    group.add_argument(
        "--largest",
        type=_pieces,
        metavar="N",
        help=f"keep the N largest connected components of the solid, or all; by default {default}",
    )


def _pieces(text):
    if text == ALL:
        return text
    try:
        return int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"expected a number or all, got {text!r}") from None


def largest_of(arguments):
    """The argument `largest` of `Isosurface`."""
    return None if arguments.largest == ALL else arguments.largest


def kept_pieces(surface, say):
    """The number of a surface's components to show if no option gives it; None for all."""
    kept, found = count_pieces(surface)
    if kept == found:
        return None
    fewer = "--largest 1 shows only the largest, " if kept > 1 else ""
    say(f"showing {kept} of {found} pieces, without the small ones; {fewer}--largest all shows all of them")
    return kept


def _annotations(text):
    if text == "none":
        return ()
    names = tuple(part.replace("-", "_") for part in text.split(","))
    for name in names:
        if name not in ANNOTATIONS:
            raise argparse.ArgumentTypeError(f"expected scale-bar, colorbar, scale-bar,colorbar or none, got {text!r}")
    return names


def color(text):
    """An argument type for colours: a name, one number, or three numbers separated by commas."""
    with contextlib.suppress(ValueError):
        numbers = floats(text)
        if len(numbers) in (1, 3):
            return numbers if len(numbers) == 3 else numbers * 3
    try:
        named_color(text)
        return text
    except ValueError:
        expected = "the name of a colour, such as white or #f0c0a0, or 1 or 3 numbers from 0 to 1, separated by commas"
        raise argparse.ArgumentTypeError(f"expected {expected}, got {text!r}") from None


def background(text):
    """An argument type for backgrounds: as `color`, four numbers with an opacity, or none for no background."""
    if text in ("none", "transparent"):
        return "transparent"
    with contextlib.suppress(ValueError):
        numbers = floats(text)
        if len(numbers) == 4:
            return numbers
    return color(text)


def background_of(arguments):
    """The background of a picture: as in Python in studio light, otherwise black."""
    return 0.0 if arguments.background is None and arguments.light != "studio" else arguments.background


def studio_looks(colors, others):
    """The materials of objects in studio light; objects without a given colour get one each."""
    given = [look if look else {"color": color_of(place)} for place, look in enumerate(colors)]
    return [isospline.Material(**look, **other) for look, other in zip(given, others)]


def check_camera_options(arguments):
    """Refuse options of the camera that have no effect."""
    if arguments.projection != "perspective":
        refuse_without(arguments, ("field_of_view", "aperture"), "--projection perspective", arguments.projection)
    if not arguments.aperture:
        refuse_without(arguments, ["focus"], "--aperture", arguments.aperture)


def cameras_of(arguments, volume, marks):
    """The camera of the picture, or those of all pictures, with space for marks; of a whole volume without marks."""
    framing: dict[str, Any] = dict(
        view="three-quarter" if arguments.view == DEFAULT_VIEW else arguments.view,
        up=arguments.up,
        projection=arguments.projection,
        size=arguments.size,
        **keywords(arguments, ["field_of_view"]),
    )
    cameras: Any  # with an aperture, all are perspective ones
    if arguments.turntable:
        turn = functools.partial(turntable_cameras, volume) if marks is None else marks.cameras
        cameras = turn(arguments.turntable, **framing)
    else:
        cameras = [camera_for(volume, **framing) if marks is None else marks.camera(**framing)]
    if arguments.aperture:
        cameras = [camera.with_lens(arguments.aperture, focus_distance=arguments.focus) for camera in cameras]
    return cameras


def marks_for(arguments, scene, look):
    """The marks that are drawn into the pictures of a scene in a look.

    --annotate without a value draws a colour bar if there is a colour map.
    """
    light, unit = look["light"], unit_of(scene)
    if arguments.annotate or arguments.legend:
        light = resolve(scene, light)  # completes rules that depend on objects
    names = arguments.annotate
    if names is None:
        is_plain = arguments.session or arguments.output.lower().endswith(".exr") or not unit
        names = () if is_plain else ("scale_bar",)
    names = check_annotations(names, None, shown_looks(scene, light), None)
    return Marks(scene, light, arguments.size, names, arguments.legend, unit)


def announce_time(scene, camera, count, options, say):
    """Tell the user how long slow pictures take, as two small ones of the same scene in the same light do."""
    light, (width, height) = options["light"], options["size"]
    is_studio = isinstance(light, isospline.Studio)

    def timed(smaller):
        """The seconds of a smaller picture, and its part of the pixels."""
        size = max(1, width // smaller), max(1, height // smaller)
        begin = time.perf_counter()
        isospline.render(scene, camera, **{**options, "size": size, "layers": ()})
        return time.perf_counter() - begin, size[0] * size[1] / (width * height)

    seconds, part = timed(_SMALLER)
    if count * seconds / part < LONG:
        return
    scene.settle()  # which a picture of many rays does
    small, small_part = timed(_SMALLER)
    large, large_part = timed(_SMALLER // 2)
    # What both pictures need alike, whatever their size, is counted once.
    each_part = max(0.0, large - small) / (large_part - small_part) if large_part > small_part else 0.0
    seconds = count * min(large / large_part, large + each_part * (1 - large_part))
    if seconds >= LONG:
        hint = "; --fast leaves shadows out" if is_studio and not light.fast else ""
        say(f"rendering takes about {seconds:.0f} s{hint}")
