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
from collections.abc import Iterable

from ..base.parameters import check_path, check_type
from ..base.signatures import explained
from ..base.system import child_environment, uninterrupted, whole_file
from .image import Image
from .pixels import over_black, row_bands


@explained
def write_video(
    path: str | os.PathLike[str], images: Iterable[Image], *, fps: float = 30.0, quality: float = 7.0
) -> None:
    """Write images to a video as they are rendered. The file is written completely or not at all.

    The encoder is FFmpeg's H.264, from the package imageio-ffmpeg (``pip install isospline[video]``). Transparent parts
    of the images become black.

    Parameters
    ----------
    path : str or path-like
        Ends in ``.mp4``.
    images : iterable of Image
        All of one size, of even width and height. A generator that renders them keeps one at a time in memory.
    fps : float
        Images per second.
    quality : float
        From 0 to 10 (best).

    Raises
    ------
    ValueError
        For no images, images of different or odd sizes, another suffix, an `fps` or a `quality` out of range.
    ImportError
        Without imageio-ffmpeg.
    OSError
        If the file cannot be written.

    Examples
    --------
    >>> import isospline
    >>> def turn(scene, path):
    ...     cameras = isospline.turntable(scene, 120, size=(640, 480))
    ...     isospline.write_video(path, (isospline.render(scene, camera, size=(640, 480)) for camera in cameras))
    """
    check_path(path)
    if os.path.splitext(os.fspath(path))[1].lower() != ".mp4":
        raise ValueError(f"path: expected a name that ends in .mp4, got {os.fspath(path)!r}")
    check_type(quality, "quality", numbers.Real, "a number")
    check_type(images, "images", Iterable, "an iterable of images")
    if not 0 <= quality <= 10:
        raise ValueError(f"quality: expected a number from 0 to 10, got {quality!r}")
    images = iter(images)
    try:
        first = next(images)
    except StopIteration:
        raise ValueError("images: expected at least one, got none") from None
    check_type(first, "images", Image, "an isospline.Image each")
    width, height = first.size
    encoder = check((width, height), fps)

    command = [
        encoder,
        "-y",
        "-v",
        "error",
        "-f",
        "rawvideo",
        "-pix_fmt",
        "rgb24",
        "-s",
        f"{width}x{height}",
        "-r",
        str(fps),
        "-i",
        "-",
        "-c:v",
        "libx264",
        "-crf",
        str(round(51 * (1 - quality / 10))),
        "-pix_fmt",
        "yuv420p",
        # Colours of BT.709, declared in the file: otherwise players guess.
        "-vf",
        "scale=out_color_matrix=bt709",
        "-colorspace",
        "bt709",
        "-color_primaries",
        "bt709",
        "-color_trc",
        "bt709",
        "-movflags",
        "+faststart",
        "-f",
        "mp4",
    ]
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
                    check_type(image, "images", Image, "an isospline.Image each")
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


def check(size: tuple[int, int], fps: float) -> str:
    """Fail early if FFmpeg is missing, or does not accept images of this (width, height) and rate."""
    try:
        import imageio_ffmpeg
    except ImportError:
        message = "writing a video needs the package imageio-ffmpeg: pip install isospline[video]"
        raise ImportError(message) from None
    if size[0] % 2 or size[1] % 2:
        raise ValueError(f"size: expected an even width and height for a video, got {size[0]}x{size[1]}")
    check_type(fps, "fps", numbers.Real, "a number")
    if not 0 < fps < float("inf"):
        raise ValueError(f"fps: expected a positive number of images a second, got {fps!r}")
    return imageio_ffmpeg.get_ffmpeg_exe()
