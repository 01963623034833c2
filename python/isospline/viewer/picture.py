"""From a state to its picture: the scene, the shading, and the passes in which a picture becomes better."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .. import _core
from ..colors import srgb_to_linear
from ..rendering import render
from ..looks import CURVATURES
from ..progressive import ProgressiveRenderer

#: Rays of a pixel in the last pass.
FINAL_SAMPLES = {"phong": 16, "outline": 16, "ambient-occlusion": 16, "path-trace": 256}

# Samples of a pixel in each pass.
_PASSES = (1, 4, 16)
_PATH_TRACING_PASSES = (1, 2, 4, 8, 16, 32, 64, 128, 256)
# Curvature at the ends of a colour map that has no limits, in one over the distance of samples.
_CURVATURE = 0.25


def linear(color):
    """Linear red, green and blue of #rrggbb."""
    return tuple(srgb_to_linear([int(color[place : place + 2], 16) / 255 for place in (1, 3, 5)]).tolist())


@dataclass(frozen=True)
class Stage:
    """A pass over a picture: samples of a pixel, and those of path tracing that came before."""

    samples: int
    final: bool


def passes(state):
    """The passes of a state that stays."""
    counts = _PATH_TRACING_PASSES if state.shading == "path-trace" else _PASSES
    return [Stage(count, count == counts[-1]) for count in counts]


def color_rule(each, document):
    """What an object's colour follows from: a linear colour or one of isospline's rules."""
    if each.color_by == "color":
        return linear(each.color)
    if each.color_by == "normal":
        return _core.ColorByNormal()
    if each.color_by in CURVATURES:
        kind = CURVATURES[each.color_by]
        return _core.ColorByCurvature(kind, each.cmap, limits=each.limits or default_limits(each, document))
    volume = document[each.color_by].item
    return _core.ColorByVolume(volume, each.cmap, limits=each.limits or default_limits(each, document))


def default_limits(each, document):
    """The values of the first and the last colour of a map where a state names none; None without a map."""
    if each.color_by in ("color", "normal"):
        return None
    if each.color_by not in CURVATURES:
        return document[each.color_by].window()
    source = document[each.source]
    most = _CURVATURE / float(np.min(source.item.spacing)) if source.is_volume else 1.0
    return (0.0, most**2) if CURVATURES[each.color_by] == "gaussian" else (-most, most)


def cap_color(state, each, document):
    """The colour of the faces of a cut, or None where it is that of the surface."""
    if not (state.clip.values and state.clip.capped and each.level is not None):
        return None
    source = document[each.source]
    shown = state.slices
    window = shown.window if shown.window and shown.volume == each.source else source.window()
    return _core.ColorByVolume(source.item, "gray", limits=window)


class PictureMaker:
    """Renders states; each thread that does so has one of its own.

    The scene is changed from state to state by what differs: another level takes a millisecond, another cut a new
    isosurface of the same volume.
    """

    def __init__(self, document):
        self._document = document
        self._scene = _core.Scene([])
        self._objects = {}  # id of the state: (what it is made of, geometry id, object)
        self._indices = {}  # key of the volume: a surface that keeps the index of bricks for the others
        self._tracing = None  # what is path traced, and the renderer

    @property
    def scene(self):
        return self._scene

    def geometry_ids(self, state):
        """Geometry ids in the scene of the visible objects, by their ids in the state."""
        wanted = {each.id: each for each in state.objects if each.visible and each.opacity > 0}
        for id in [id for id in self._objects if id not in wanted]:
            self._scene.remove(self._objects.pop(id)[1])
        cuts = None if state.clip.kind == "none" else state.clip
        for id, each in wanted.items():
            made_of = (each.source, None if each.level is None else cuts)
            known = self._objects.get(id)
            if known and known[0] != made_of:
                self._scene.remove(known[1])
                known = None
            if known is None:
                item = self._item(each, state.clip)
                self._objects[id] = (made_of, self._scene.add(item), item)
            elif each.level is not None and known[2].level != each.level:
                known[2].level = each.level
        return {id: geometry for id, (_, geometry, _) in self._objects.items()}

    def _item(self, each, clip):
        source = self._document[each.source]
        item = source.item
        if each.level is None:
            return item
        cuts = clip.cuts()
        if each.source not in self._indices:
            self._indices[each.source] = source.template or _core.Isosurface(item, each.level)
        if cuts is None:
            return self._indices[each.source].with_level(each.level)
        return _core.Isosurface(item, each.level, clip=cuts, capped=clip.capped)

    def shadings(self, state, ids, moving=False):
        """A shading of each geometry id."""
        return {ids[each.id]: self._shading(state, each, moving) for each in state.objects if each.id in ids}

    def _shading(self, state, each, moving):
        look = dict(opacity=each.opacity, cap_color=cap_color(state, each, self._document))
        color = color_rule(each, self._document)
        if state.shading == "outline":
            return _core.Outline(state.exponent, surface_color=color, color=0.02, **look)
        if state.shading == "ambient-occlusion" and not moving:
            return _core.AmbientOcclusion(color=color, **look)
        return _core.Phong(color=color, shadows=state.shadows and not moving, **look)

    def integrator(self, state, ids):
        """The path tracer of a state."""
        materials = {
            ids[each.id]: _core.Material(
                color_rule(each, self._document), metallic=each.metallic, roughness=each.roughness,
                cap_color=cap_color(state, each, self._document),
            )
            for each in state.objects if each.id in ids
        }  # fmt: skip
        return _core.PathTracer(materials=materials, lights=path_tracing_lights(state.camera))

    def render(self, state, size, stage=None, progress=None, **options):
        """The image of a state, which has a camera; without a stage as it looks while something moves."""
        ids = self.geometry_ids(state)
        options.setdefault("background", linear(state.background))
        if stage is not None and state.shading == "path-trace":
            return self._path_trace(state, ids, size, stage.samples, progress, options)
        return render(
            self._scene, state.camera.camera(), size=size, shading=self.shadings(state, ids, moving=stage is None),
            samples=stage.samples if stage else 1, progress=progress, **options,
        )  # fmt: skip

    def _path_trace(self, state, ids, size, samples, progress, options):
        """Goes on from the last pass where the state is the same."""
        tracing = (state, size, tuple(options.items()))
        if self._tracing is None or self._tracing[0] != tracing or self._tracing[1].samples > samples:
            renderer = ProgressiveRenderer(
                self._scene, state.camera.camera(), size=size, integrator=self.integrator(state, ids), **options
            )
            self._tracing = (tracing, renderer)
        renderer = self._tracing[1]
        try:
            if samples > renderer.samples:
                renderer.step(samples - renderer.samples, progress=progress)
        except _core.Cancelled:
            self._tracing = None
            raise
        return renderer.image


def path_tracing_lights(camera):
    """An even sky, and a lamp over the viewer's left shoulder."""
    right, up, forward = camera.camera().world_to_camera[:3, :3]
    direction = forward + 0.6 * right - 0.8 * up
    return [
        _core.EnvironmentLight(0.7),
        _core.DirectionalLight(tuple(direction.tolist()), intensity=0.45 * math.pi),
    ]
