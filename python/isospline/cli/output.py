"""Checks that the output of the command line can be written, before the work begins."""

from __future__ import annotations

from ..picture.sequences import PICTURES, check_folder, check_sequence, is_video
from .given import keywords, refuse_without


def check_output(arguments):
    """Check before the work begins that the output can be written."""
    path = arguments.output
    if arguments.turntable is not None:
        if arguments.turntable < 1:
            raise ValueError(f"--turntable: expected at least 1 picture, got {arguments.turntable}")
        check_sequence(path, arguments.turntable, arguments.size, **keywords(arguments, ["fps"]))
    elif not path.lower().endswith(PICTURES):
        videos = " (for a video, say --turntable)" if is_video(path) else ""
        raise ValueError(f"{path}: expected the name of a picture, which ends in {' or '.join(PICTURES)}{videos}")
    else:
        check_folder(path)
    if arguments.turntable is None or not is_video(path):
        refuse_without(arguments, ["fps"], "a video of --turntable", path)
    if arguments.layers and not path.lower().endswith(".exr"):
        raise ValueError(f"--layers: expected the name of a picture that has layers, which ends in .exr, got {path}")
    traced = {"direct", "variance"} & set(arguments.layers)
    if traced and arguments.light != "path-trace":
        raise ValueError(f"--layers: expected {min(traced)} with --light path-trace only, got {arguments.light}")
    if "ambient_occlusion" not in arguments.layers:
        names = ",".join(arguments.layers) or None
        refuse_without(arguments, ["ambient_occlusion_samples"], "--layers ambient_occlusion", names)
