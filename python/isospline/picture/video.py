"""Videos of rendered images."""

from __future__ import annotations

import contextlib
import errno
import itertools
import numbers
import os
import signal
import subprocess
import tempfile
from collections.abc import Iterable, Iterator
from typing import Any

from ..base.parameters import check_path, check_type
from ..base.signatures import explained
from ..base.system import child_environment, uninterrupted, whole_file
from .image import Image
from .pixels import over_black, row_bands

# FFmpeg's options for files of each kind. Colours of BT.709 are declared in the file: otherwise players guess. New
# versions take the declaration from the images, which the filter setparams labels, old ones from options.
_BT709 = {"colorspace": "bt709", "color_primaries": "bt709", "color_trc": "bt709"}
_LABELS = ":".join(f"{name}={value}" for name, value in _BT709.items())
_MP4 = ["-c:v", "libx264", "-profile:v", "high", "-pix_fmt", "yuv420p"]
_MP4 += ["-vf", f"scale=out_color_matrix=bt709,setparams={_LABELS}"]
_MP4 += [word for name, value in _BT709.items() for word in (f"-{name}", value)]
_MP4 += ["-movflags", "+faststart+write_colr", "-f", "mp4"]
# A palette for each image, so that no image is kept; a regular pattern of dots, which does not flicker.
_PALETTES = "split[a][b];[a]palettegen=stats_mode=single[p];[b][p]paletteuse=new=1:dither=bayer:bayer_scale=4"
_GIF = ["-filter_complex", _PALETTES, "-loop", "0", "-f", "gif"]
# Delays are 16 bits, in hundredths of a second; browsers show faster ones slowly: a delay of 1 means 10.
_GIF_RATES = 100 / 65535, 50


@explained
def write_video(
    path: str | os.PathLike[str], images: Iterable[Image], *, fps: float = 30.0, quality: float = 7.0
) -> None:
    """Write images to a video as they are rendered. The file is written completely or not at all.

    The encoder is FFmpeg, from the package imageio-ffmpeg (``pip install isospline[video]``). Transparent parts of the
    images become black. `turntable` and `animate` render the images, too.

    Parameters
    ----------
    path : str or path-like
        Ends in ``.mp4`` for H.264, or in ``.gif`` for an animation that repeats, with 256 colours per image.
    images : iterable of Image
        All of one size; of an MP4, of even width and height. A generator that renders them keeps one at a time in
        memory.
    fps : float
        Images per second; of a GIF, 0.00153 to 50.
    quality : float
        Of an MP4, from 0 to 10 (best).

    Raises
    ------
    ValueError
        For no images, images of different sizes, odd ones of an MP4, another suffix, an `fps` or a `quality` out of
        range.
    ImportError
        Without imageio-ffmpeg.
    OSError
        If the file cannot be written.

    Examples
    --------
    >>> import isospline
    >>> def turn(scene, path):
    ...     cameras = isospline.turntable_cameras(scene, 120, size=(640, 480))
    ...     isospline.write_video(path, (isospline.render(scene, camera, size=(640, 480)) for camera in cameras))
    """
    check_path(path)
    if not os.fspath(path).lower().endswith((".mp4", ".gif")):
        raise ValueError(f"path: expected a name that ends in .mp4 or .gif, got {os.fspath(path)!r}")
    check_type(images, "images", Iterable, "an iterable of images")
    encode(path, _checked(images), fps=fps, quality=quality)


def _checked(images: Iterable[Any]) -> Iterator[Image]:
    for image in images:
        check_type(image, "images", Image, "an isospline.Image each")
        yield image


def encode(path: str | os.PathLike[str], images: Iterable[Any], *, fps: float, quality: float) -> None:
    """Write images, or other objects with their `size` and `to_srgb`, as `write_video` does."""
    check_quality(quality)
    images = iter(images)
    try:
        first = next(images)
    except StopIteration:
        raise ValueError("images: expected at least one, got none") from None
    width, height = first.size
    encoder = check(path, (width, height), fps)
    source = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", str(fps), "-i", "-"]
    loss = max(1, round(51 * (1 - quality / 10)))  # 0 is lossless, which the profile High has not, nor many players
    options = _GIF if os.fspath(path).lower().endswith(".gif") else [*_MP4, "-crf", str(loss)]
    command = [encoder, "-y", "-v", "error", *source, *options]
    with whole_file(path) as temporary, tempfile.TemporaryFile() as complaints:
        process = None
        try:
            with uninterrupted():
                # In a session of its own, so that only this process receives Ctrl-C.
                process = subprocess.Popen(
                    [*command, temporary],
                    stdin=subprocess.PIPE,
                    stderr=complaints,
                    start_new_session=True,
                    env=child_environment(),
                )
            assert process.stdin is not None  # it is a pipe
            with contextlib.suppress(BrokenPipeError), process.stdin:
                for image in itertools.chain([first], images):
                    if image.size != (width, height):
                        raise ValueError(f"images: expected all of one size, got {(width, height)} and {image.size}")
                    frame = over_black(image)
                    for rows in row_bands(frame):
                        process.stdin.write(frame[rows].tobytes())
            if process.wait() != 0:
                complaints.seek(0)
                reason = "; ".join(complaints.read().decode(errors="replace").split("\n")).strip("; ")
                raise _system_error(reason or f"exit code {process.returncode}", process.returncode)
        finally:
            if process is not None:
                with process:
                    process.kill()


def _system_error(reason: str, code: int) -> OSError:
    """The system's own error, if FFmpeg reports one."""
    named = (number for number in errno.errorcode if number > 0 and os.strerror(number) in reason)
    number = errno.EFBIG if code == -signal.SIGXFSZ else next(named, None)
    if number is not None:
        return OSError(number, os.strerror(number))
    return OSError(errno.EIO, f"FFmpeg failed: {reason}")


def check_rate(fps: Any) -> None:
    """Check a number of images a second."""
    check_type(fps, "fps", numbers.Real, "a number")
    if not 0 < fps < float("inf"):
        raise ValueError(f"fps: expected a positive number of images a second, got {fps!r}")


def check_quality(quality: Any) -> None:
    """Check the quality of a video."""
    check_type(quality, "quality", numbers.Real, "a number")
    if not 0 <= quality <= 10:
        raise ValueError(f"quality: expected a number from 0 to 10, got {quality!r}")


def check(path: str | os.PathLike[str], size: tuple[int, int] | None, fps: float) -> str:
    """Fail early if FFmpeg is missing, or does not accept images of this (width, height) and rate; else its path."""
    try:
        import imageio_ffmpeg
    except ImportError:
        message = "writing a video needs the package imageio-ffmpeg: pip install isospline[video]"
        raise ImportError(message) from None
    is_gif = os.fspath(path).lower().endswith(".gif")
    if not is_gif and size is not None and (size[0] % 2 or size[1] % 2):
        raise ValueError(f"size: expected an even width and height for a video, got {size[0]}x{size[1]}")
    check_rate(fps)
    if is_gif and not _GIF_RATES[0] <= fps <= _GIF_RATES[1]:
        least, most = _GIF_RATES
        raise ValueError(f"fps: expected {least:.3g} to {most:g} images a second of a GIF, got {fps!r}")
    return imageio_ffmpeg.get_ffmpeg_exe()
