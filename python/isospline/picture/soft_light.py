"""Soft light from few rays: more of them only where a picture needs them.

Colours without shadows have no noise: a pixel whose colour is that of its neighbours needs one ray, as in T. Whitted,
"An improved illumination model for shaded display", Communications of the ACM 23(6), 1980. What shadows leave of the
light is a mean over blocks of pixels that send their rays in different directions; where it changes slowly, one pixel
in four sends any.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import _core
from ..looks import AmbientOcclusion, Phong
from .image import Image
from .materials import UNLIT, is_translucent

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from numpy.typing import NDArray

    from ..lights import DirectionalLight
    from ..scene import Scene

    Looks = Mapping[int, Any]
    Report = Callable[[float], Any]

#: Pixels beside a crop on which its pixels depend, at most: means over coarse blocks are compared with those of a block
#: beside them, on a ground where surfaces are near, whose outlines are found by a pixel's neighbours.
MARGIN = 3 * _core.COARSE_REACH + 2
#: Rays to a light from a pixel that sends any. Means over blocks of the fewest have little noise, and those of the most
#: have less than pictures can show.
LEAST_RAYS, MOST_RAYS = 4, 1024
# The layers that tell surfaces apart.
_GUIDES = ("position", "normal", "geometry_ids")


class SoftLight:
    """A key light with soft shadows, a fill light without, and an even sky of brightness 1.

    `count` rays go to the key light, and to the sky, from a pixel that sends any. The sky is hidden by what is nearer
    than `distance`.
    """

    def __init__(self, key: DirectionalLight, fill: DirectionalLight, count: int, distance: float):
        self._unhidden: dict[str, Any] = {"lights": [key], "shadows": False, "ambient": 0}
        self._filled: dict[str, Any] = {**self._unhidden, "lights": [fill], "specular": 0}
        self._count, self._distance = count, distance or math.inf

    def open(self, looks: Looks) -> list[Looks]:
        """Looks in the key light, the sky and the fill light, without shadows."""
        changes = (self._unhidden, UNLIT, self._filled)
        return [{id: look.replace(**each) for id, look in looks.items()} for each in changes]

    def hidden(self, looks: Looks, samples: int = 1) -> list[Looks]:
        """Looks in the key light and the sky with shadows, for one of several rays through a pixel."""
        count = math.ceil(self._count / samples)
        shadowed = {**self._unhidden, "shadows": True, "shadow_samples": count}
        return [
            {id: look.replace(**shadowed) for id, look in looks.items()},
            {id: self._sky(look, count) for id, look in looks.items()},
        ]

    def on_plane(self, looks: Looks, id: int, diffuse_of_white: float) -> list[Looks]:
        """The looks of `hidden` with a white plane."""
        white = Phong(specular=0, diffuse=diffuse_of_white)
        (in_key, _), (_, in_sky) = self.hidden({id: white}), self.hidden({id: Phong()})
        return [{**looks, **in_key}, {**looks, **in_sky}]

    def _sky(self, look: Any, count: int) -> AmbientOcclusion:
        names = ("color", "opacity", "silhouette_opacity", "silhouette_exponent", "cap_color")
        return AmbientOcclusion(count, distance=self._distance)._taking(look, names)


def part_of(report: Report | None, begin: float, end: float) -> Report | None:
    """Progress from 0 to 1 of a part of the work, from `begin` to `end` of the whole."""
    return report and (lambda fraction: report(begin + (end - begin) * fraction))


class Passes:
    """Passes over the pixels of a picture, of which later ones render some pixels again."""

    def __init__(self, camera: Any, options: Mapping[str, Any], report: Report | None, done: float):
        self._camera, self._report = camera, report
        self.has_lens = getattr(camera, "aperture_radius", 0.0) > 0
        self._options = {name: options[name] for name in ("size", "crop")}
        self._occlusion_samples = options["ambient_occlusion_samples"]  # checked, though no layer needs them
        self.done = done
        self.first = (0, 0) if options["crop"] is None else options["crop"][:2]

    def _progress(self, until: float) -> Report | None:
        begin, self.done = self.done, until
        return part_of(self._report, begin, until)

    def pictures(self, scene: Scene, looks: Sequence[Looks], until: float) -> list[Image]:
        """Pictures in several looks with one ray through each pixel; the first has the layers of its centre."""
        options: dict[str, Any] = {"layers": _GUIDES, "positions_from_eye": True, "samples": 1, **self._options}
        options.update(ambient_occlusion_samples=self._occlusion_samples, progress=self._progress(until))
        return [Image(each) for each in _core.render_looks(scene, self._camera, shadings=looks, **options)]

    def again(
        self,
        pictures: Sequence[Image],
        scene: Scene,
        looks: Sequence[Looks],
        mask: NDArray[np.bool_],
        until: float,
        *,
        samples: int = 1,
        step: int = 1,
    ) -> None:
        """Render the pixels of a mask, in each `step`-th column and row, into the pictures."""
        options: dict[str, Any] = {"samples": samples, "mask": mask, "step": step, **self._options}
        images = [each._arrays for each in pictures]
        options.update(shadings=looks, images=images, progress=self._progress(until))
        _core.render_again(scene, self._camera, **options)


def lit_surfaces(
    passes: Passes, light: SoftLight, sky: float, scene: Scene, looks: Looks, samples: int, until: float
) -> Image:
    """A picture of Phong shadings in a soft light, linear and without a background.

    `sky` is the brightness of the sky. `samples` rays go through each pixel whose colour differs from a neighbour's,
    and with a lens through all.
    """
    begin = passes.done

    def after(part):
        return begin + part * (until - begin)

    in_open, in_hidden, in_part = light.open(looks), light.hidden(looks), light.hidden(looks, samples)
    open_key, open_sky, filled = pictures = passes.pictures(scene, in_open, after(0.2))
    guides = open_key._arrays
    edges = _core.edges(guides)

    # Where a pixel shows surfaces of different colours, one part of the light is not that of all channels.
    by_channel = passes.has_lens or any(map(is_translucent, looks.values()))

    def seen(hidden, mask, step):
        in_key, in_sky = hidden
        pairs = (in_key._arrays, guides), (in_sky._arrays, open_sky._arrays)
        return _core.seen_parts(pairs, guides, edges, mask, step, by_channel)

    hidden = [Image(guides.blank()) for _ in in_hidden]
    if passes.has_lens:  # each ray of a pixel may show another surface
        everywhere = np.ones_like(edges)
        passes.again(pictures + hidden, scene, in_open + in_part, everywhere, until, samples=samples)
        seen_parts = seen(hidden, everywhere, 1)
    else:
        sum = [(guides, 1.0), (open_sky._arrays, sky), (filled._arrays, 1.0)]
        uneven = _core.uneven_pixels(sum, guides, edges)
        coarse = [Image(guides.blank()) for _ in in_hidden]
        passes.again(coarse, scene, in_hidden, open_key.color[..., 3] > 0, after(0.5), step=_core.COARSE_STEP)
        seen_parts = seen(coarse, ~edges, _core.COARSE_STEP)
        change = _core.changes(seen_parts, guides, edges)
        near = _core.widened(change > 0, _core.FINE_REACH)
        passes.again(hidden, scene, in_hidden, near & ~edges, after(0.7))
        passes.again(pictures + hidden, scene, in_open + in_part, uneven & edges, after(0.9), samples=samples)
        change[edges] = 1
        np.copyto(seen_parts, 0, where=change == 1)
        seen_parts += change * (seen(hidden, change > 0, 1) - seen_parts)
        # Light is compared with and without shadows of the same rays: other colours of several rays come last.
        passes.again(pictures, scene, in_open, uneven & ~edges & (samples > 1), until, samples=samples)
    of_key, of_sky = np.moveaxis(seen_parts, 1, -1)
    color = open_key.color[..., :3]
    color[:] = of_key * color + sky * of_sky * open_sky.color[..., :3] + filled.color[..., :3]
    return open_key


def hidden_from_plane(
    passes: Passes,
    scene: Scene,
    looks: Sequence[Looks],
    weights: tuple[float, float],
    beside: Image,
    until: float,
) -> NDArray[np.float32]:
    """The part of the key light and of the sky, each with a weight, that a white plane does not get, (height, width).

    The plane is the only visible surface of `scene`. It is needed where the picture `beside` is not covered. A plane
    has no edges, so one ray through a pixel is enough.
    """
    in_key, in_sky = (Image(beside._arrays.blank()) for _ in range(2))
    seen = beside.color[..., 3] < 1
    near = _core.widened(seen, _core.COARSE_REACH)

    def hidden(step):
        parts = [each.color[..., 3] - each.color[..., 0] for each in (in_key, in_sky)]
        both = weights[0] * parts[0] + weights[1] * parts[1]
        return _core.mean_on_plane(both, in_key.color[..., 3], passes.first, step)

    begin = passes.done
    passes.again([in_key, in_sky], scene, looks, near, 0.5 * (begin + until), step=_core.COARSE_STEP)
    result = hidden(_core.COARSE_STEP)
    change = _core.changes_on_plane(result)
    change[~seen] = 0
    in_key, in_sky = (Image(beside._arrays.blank()) for _ in range(2))
    passes.again([in_key, in_sky], scene, looks, _core.widened(change > 0, _core.FINE_REACH) & near, until)
    return result + change * (hidden(1) - result)
