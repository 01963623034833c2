"""Animations in one call: a turn around a scene, and the pictures of a function of time."""

from __future__ import annotations

import numbers
import os
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ..base.mistakes import described, sentence
from ..base.parameters import COUNT_LIMIT, check_count, check_type
from ..base.progress import as_callable, part_of, tell
from ..base.signatures import explained
from ..base.views import DEFAULT_VIEW, SIZE, View
from .annotations import Annotation
from .cameras import Projection, camera_for
from .defaults import background_of, marks_of
from .files import in_detail
from .image import Image
from .lights import Light, in_environment, resolve
from .marks import Marks
from .pixels import Pixels
from .rendering import without_marks
from .scenes import as_scene
from .sequences import check_sequence, write_sequence
from .studio import Studio, upward_for
from .video import check_quality, check_rate

if TYPE_CHECKING:
    from ..base.types import Background, Color, Progress

#: Seconds of an animation by default.
SECONDS = 4.0


@explained
def turntable(
    scene: Any,
    path: str | os.PathLike[str],
    *,
    frames: int | None = None,
    seconds: float | None = None,
    fps: float = 30.0,
    quality: float = 7.0,
    view: View = DEFAULT_VIEW,
    up: ArrayLike | None = None,
    projection: Projection = "perspective",
    field_of_view: float = 30.0,
    margin: float = 0.05,
    size: tuple[int, int] = SIZE,
    level: float | None = None,
    light: Light = None,
    environment: Any = None,
    color: Color | None = None,
    opacity: float | None = None,
    background: Background = None,
    samples: int = 4,
    annotate: bool | Annotation | Iterable[Annotation] | None = None,
    unit: str | None = None,
    legend: bool = False,
    progress: Progress = None,
) -> Path:
    """Render one turn around a scene to a video or to numbered pictures.

    Frame k of n is seen from the camera ``turntable_cameras(scene, n)[k]``, or with marks from one that leaves space
    for them; after the last frame, the first one follows without a jump. Frames are written as they are rendered.
    Ctrl-C stops the work.

    Parameters
    ----------
    scene
        As in `render`.
    path : str or path-like
        Where the frames are written: a video if it ends in ``.mp4`` or ``.gif``; pictures for a name such as
        ``turn-####.png`` or ``turn-####.exr``, with the number in place of ``####``; otherwise a folder, in which they
        are ``frame-0000.png`` and so on, and which is made if it does not exist. A video is written completely or not
        at all, and so is each picture: after an error or Ctrl-C, the pictures that are finished stay.
    frames : int, optional
        Number of frames of the turn; by default as many as `seconds` need.
    seconds : float, optional
        Time of the turn, in place of `frames`; by default 4.
    fps, quality : float
        Frames per second, and the quality of an MP4, as in `write_video`, whose package videos need.
    view, up, projection, field_of_view, margin
        Of the cameras, as in `turntable_cameras`.
    size : (int, int)
        Width and height of the frames in pixels; even numbers for an MP4.
    level, light, environment, color, opacity, background
        As in `render`. In videos, a transparent background is black.
    samples : int
        Rays per pixel, as in `render`. Take more for path tracing.
    annotate, unit, legend
        As in `render`; they are beside the scene.
    progress : callable or True, optional
        Called with the finished fraction; cancels the work by returning a false value other than None. True shows a
        bar.

    Returns
    -------
    pathlib.Path
        The path.

    Raises
    ------
    ValueError
        For both `frames` and `seconds`; for another kind of path, and pictures there beyond the last frame; and
        as in `render`, `turntable_cameras` and `write_video`.
    TypeError
        For a number in place of the path.
    ImportError
        For a video without imageio-ffmpeg.
    OSError
        If the files cannot be written.
    Cancelled
        If `progress` cancelled it.

    Examples
    --------
    >>> import isospline, os, tempfile
    >>> torus = isospline.volumes.torus()
    >>> surface = isospline.Isosurface(torus.volume(16), torus.level, color="ivory")
    >>> folder = tempfile.mkdtemp()
    >>> path = isospline.turntable(surface, os.path.join(folder, "turn"), frames=2, size=(32, 24))
    >>> sorted(os.listdir(path))
    ['frame-0000.png', 'frame-0001.png']
    >>> isospline.turntable(surface, "turn.mp4", seconds=6, progress=True)  # doctest: +SKIP
    """
    if isinstance(path, numbers.Real):
        raise TypeError(sentence("path", _PATH, path, f"turntable_cameras(scene, {path})"))
    count = _frame_count(frames, seconds, fps)
    check_sequence(path, count, size, fps)
    check_quality(quality)
    check_count(samples, "samples", 65536)
    is_default = light is None and environment is None
    given, scene = scene, as_scene(scene, level)
    frame: dict[str, Any] = dict(view=view, up=up, projection=projection, field_of_view=field_of_view)
    frame.update(size=size, margin=margin)
    upward = None
    if environment is not None:
        upward = upward_for(scene, camera_for(scene, **frame))
        light = in_environment(light, environment, upward)
    look = resolve(scene, light, color, opacity)
    names = marks_of(annotate, scene, None, look, unit, is_default=is_default)
    marks = Marks(scene, look, size, names, legend, unit)
    cameras = marks.cameras(count, **frame)
    shown = in_detail(scene, given, cameras, size)
    if shown is not scene:  # rules and their bars measure what is shown
        look = resolve(shown, light, color, opacity)
        marks = Marks(shown, look, size, names, legend, unit)
    if isinstance(look, Studio) and look.up is None:  # the same ground for all cameras
        look = look.replace(up=upward_for(scene, cameras[0]))
    told = as_callable(progress)

    def images() -> Iterator[Image]:
        options: dict[str, Any] = dict(size=size, background=background_of(background, look), samples=samples)
        for number, camera in enumerate(cameras):
            image = without_marks(shown, camera, look, progress=part_of(told, number, count), **options)
            yield marks.draw(image, camera, is_fitted=True)

    write_sequence(path, images(), fps=fps, quality=quality)
    return Path(path)


@explained
def animate(
    function: Callable[[float], Any],
    path: str | os.PathLike[str],
    *,
    frames: int | None = None,
    seconds: float | None = None,
    fps: float = 30.0,
    quality: float = 7.0,
    progress: Progress = None,
) -> Path:
    """Write the pictures that a function of time returns to a video or to numbered pictures.

    Frame k of n is ``function(k / n)``. So time runs from 0 to 1, without 1: if ``function(1)`` would be
    ``function(0)``, as in a turn, the video repeats without a jump and without the same frame twice. For a video that
    ends with the state at 1, use ``t * n / (n - 1)``. Each frame is written before the next one is made, so that one is
    in memory.

    Parameters
    ----------
    function : callable
        Called as ``function(t)``, with 0 <= t < 1, once for each frame in order. Returns an `Image`, or a
        (height, width, 3 or 4) uint8 array of sRGB, of which the fourth part is alpha; all of one size.
    path : str or path-like
        As in `turntable`.
    frames, seconds, fps, quality
        As in `turntable`.
    progress : callable or True, optional
        Called with the finished fraction before each frame and at the end; cancels the work by returning a false value
        other than None. True shows a bar.

    Returns
    -------
    pathlib.Path
        The path.

    Raises
    ------
    TypeError
        For a function that returns anything else.
    ValueError
        For frames of different sizes, and as in `turntable`.
    ImportError, OSError, Cancelled
        As in `turntable`.

    Examples
    --------
    A sphere that grows:

    >>> import isospline, os, tempfile
    >>> sphere = isospline.volumes.sphere().volume(16)
    >>> camera = isospline.camera_for(sphere, view="front", size=(32, 24))
    >>> def picture(t):
    ...     return isospline.render(isospline.Isosurface(sphere, -0.5 * t), camera, size=(32, 24), background="white")
    >>> path = isospline.animate(picture, os.path.join(tempfile.mkdtemp(), "####.png"), frames=3)
    >>> sorted(os.listdir(path.parent))
    ['0000.png', '0001.png', '0002.png']
    """
    if not callable(function):
        raise TypeError(sentence("function", "a function that returns the picture at a time from 0 to 1", function))
    count = _frame_count(frames, seconds, fps)
    check_sequence(path, count, None, fps)
    check_quality(quality)
    told = as_callable(progress)

    def images() -> Iterator[Any]:
        size = None
        for number in range(count):
            tell(told, number / count)
            image = _frame(function, number / count)
            if size not in (None, image.size):
                raise ValueError(f"function: expected frames of one size, got {size} and {image.size}")
            size = image.size
            yield image
        tell(told, 1.0)

    write_sequence(path, images(), fps=fps, quality=quality)
    return Path(path)


_PATH = "the name of a video, such as turn.mp4, or of a folder"


def _frame_count(frames: Any, seconds: Any, fps: Any) -> int:
    """The number of frames of an animation."""
    check_rate(fps)
    if frames is not None:
        if seconds is not None:
            raise ValueError(f"seconds: cannot be combined with frames, got {seconds!r} and {frames!r}; see fps")
        check_count(frames, "frames")
        return int(frames)
    length = SECONDS if seconds is None else seconds
    check_type(length, "seconds", numbers.Real, "a number")
    if not 0 < length * fps <= COUNT_LIMIT:
        raise ValueError(f"seconds: expected a number above 0, with at most {COUNT_LIMIT} frames, got {length!r}")
    return max(1, round(length * fps))


def _frame(function: Callable[[float], Any], time: float) -> Image | Pixels:
    """The frame that a function returns for a time."""
    frame = function(time)
    if isinstance(frame, Image):
        return frame
    is_picture = isinstance(frame, np.ndarray) and frame.dtype == np.uint8 and frame.ndim == 3 and frame.size > 0
    if not (is_picture and frame.shape[2] in (3, 4)):
        expected = "an Image or a (height, width, 3 or 4) uint8 array"
        raise TypeError(f"function: expected {expected} from function({time:g}), got {described(frame)}")
    return Pixels(frame)
