"""What a picture has if nothing is said: the same in Python, on the command line, in notebooks and in the viewer."""

from __future__ import annotations

from typing import Any

from ..base.parameters import check_count
from ..colors import BACKGROUND
from ..scene import Scene
from .annotations import check_annotations, has_scale, shown_looks
from .marks import unit_of
from .studio import Studio

#: Rays per pixel in a studio; other lights have one.
STUDIO_SAMPLES = 4


def samples_of(samples: int | None, look: Any) -> int:
    """The number of rays per pixel."""
    if samples is None:
        return STUDIO_SAMPLES if isinstance(look, Studio) else 1
    check_count(samples, "samples", 65536)
    return samples


def background_of(background: Any, look: Any) -> Any:
    """The background of a picture: by default light in a studio, and otherwise transparent."""
    return BACKGROUND if background is None and isinstance(look, Studio) else background


def marks_of(
    annotate: Any,
    scene: Scene,
    camera: Any,
    look: Any,
    unit: str | None,
    *,
    is_default: bool,
    is_crop: bool = False,
) -> tuple[str, ...]:
    """The names of the marks of a picture: by default a scale bar in the default light, if the unit is known."""
    if annotate is None:
        is_drawn = is_default and not is_crop and has_scale(camera) and bool(unit or unit_of(scene))
        annotate = ("scale_bar",) if is_drawn else ()
    return check_annotations(annotate, camera, shown_looks(scene, look), unit)
