"""Long pictures of the command line: limits, checkpoints, and resuming after Ctrl-C."""

from __future__ import annotations

import math
import os

from ..picture.sequences import check_folder, is_video, numbered
from .given import refuse_without
from .record import Record, record_path

#: Samples of a pixel if nothing else ends a path traced picture.
DEFAULT_SAMPLES = 64


def add_limits(command):
    """The options of `ProgressiveRenderer.run`, and of continuing after a pause."""
    group = command.add_argument_group("limits of path-trace")
    group.add_argument(
        "--noise",
        type=float,
        metavar="X",
        help="end when one standard error changes the picture by X of its range, such as 0.01; with it "
        "or --time-limit, only --samples limits the number of samples",
    )
    group.add_argument("--time-limit", type=float, metavar="SECONDS", help="end after this time")
    group = command.add_argument_group("continuing after a pause")
    group.add_argument(
        "--checkpoint",
        metavar="FILE",
        help="save what is rendered of a path traced picture to a file, every minute, at the end and on Ctrl-C",
    )
    group.add_argument(
        "--resume",
        action="store_true",
        help="continue from --checkpoint, to the same picture as without a pause; numbered pictures of a --turntable "
        "need no checkpoint: those that the same options made are kept",
    )


def check_limits(arguments):
    """Check before the work begins that the options fit together."""
    path = arguments.checkpoint
    if arguments.turntable:
        if path is not None:
            raise ValueError(
                f"--checkpoint: expected one picture, got --turntable {arguments.turntable}: "
                "--resume alone keeps its numbered pictures and makes those that are missing"
            )
        if arguments.resume and is_video(arguments.output):
            raise ValueError(
                f"--resume: expected numbered pictures, such as turn-####.png, got the video {arguments.output}"
            )
        return
    if path is None:
        refuse_without(arguments, ["resume"], "--checkpoint")
        return
    check_folder(path)
    if arguments.resume:
        with open(path, "rb"):
            pass  # raises the system's error if it cannot be opened
    elif os.path.exists(path):
        raise ValueError(f"--checkpoint: expected --resume, or the name of a new file, got {path}, which exists")


def frames_to_make(cameras, arguments, made_of, say):
    """The numbers of the missing pictures, of a turntable or a single one, and their cameras.

    Pictures of a turntable that are recorded as `made_of` the same are not missing.
    """
    numbers = range(len(cameras))
    if not (arguments.turntable and arguments.resume):
        return numbers, cameras
    record = Record(record_path(arguments.output))
    outputs = [numbered(arguments.output, number) for number in numbers]
    missing = [at for at, path in enumerate(outputs) if not (os.path.exists(path) and record.has(path, made_of))]
    say(f"{len(numbers) - len(missing)} of {len(numbers)} pictures exist already")
    return missing, [cameras[number] for number in missing]


def traced_images(renderer, arguments, progress, say):
    """The image of a `ProgressiveRenderer` within the limits; after Ctrl-C, the image so far, and Ctrl-C again."""
    samples = arguments.samples
    is_open = arguments.noise is not None or arguments.time_limit is not None
    if samples is None and not is_open:
        samples = DEFAULT_SAMPLES
    if arguments.resume and arguments.checkpoint is not None:
        renderer.load_checkpoint(arguments.checkpoint)
        say(f"{arguments.checkpoint}: continues after {renderer.samples} samples a pixel")
    try:
        image = renderer.run(
            samples,
            noise=arguments.noise,
            time_limit=arguments.time_limit,
            checkpoint=arguments.checkpoint,
            progress=progress,
        )
    except KeyboardInterrupt:
        if arguments.turntable or renderer.samples == 0:
            raise
        yield renderer.image
        go_on = "" if arguments.checkpoint is None else "; --resume continues"
        say(f"{arguments.output}: has {renderer.samples} samples a pixel{go_on}")
        raise
    if is_open:
        noise = renderer.noise  # not finite after an unfinished pass over the picture
        say(f"{renderer.samples} samples a pixel" + (f", noise {noise:.2g}" if math.isfinite(noise) else ""))
    yield image
