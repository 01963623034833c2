"""Rendering of a state: the scene, the shading, and the passes that refine a picture."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .. import _core
from ..base.system import without_warnings
from ..color_rules import ColorByCurvature, ColorByNormal, ColorByVolume
from ..colors import CURVATURES
from ..lights import DirectionalLight
from ..looks import AmbientOcclusion, Outline, Phong
from ..picture.defaults import STUDIO_SAMPLES
from ..picture.environments import EnvironmentLight
from ..picture.lights import resolve
from ..picture.materials import names_in_shadings
from ..picture.path_tracer import PathTracer
from ..picture.progressive import ProgressiveRenderer
from ..picture.rendering import render
from ..picture.studio import Studio
from ..scene import Isosurface, Scene
from .state import SliceState

#: Rays per pixel in the last pass.
FINAL_SAMPLES = {"studio": STUDIO_SAMPLES, "phong": 16, "outline": 16, "ambient-occlusion": 16, "path-trace": 256}

#: The lights of path tracing: the sky, the lamp's irradiance / pi, and how far its direction is to the right and up.
SKY, LAMP, LAMP_RIGHT, LAMP_UP = 0.7, 0.45, 0.6, -0.8

# The part of the sky that surfaces see in moving pictures: in path tracing, and in ambient occlusion at outlines.
_SEEN_SKY, _AT_EDGES = 0.92, 0.5

# The part of light that dielectrics and usual metals reflect, and the smallest square of a roughness, for highlights.
_DIELECTRIC, _METAL, _SHARPEST = 0.04, 0.7, 0.02

# Samples per pixel in each pass.
_PASSES = {"studio": (1, STUDIO_SAMPLES), "path-trace": (1, 2, 4, 8, 16, 32, 64, 128, 256)}
_OTHER_PASSES = (1, 4, 16)
# Curvature at the ends of a colour map without limits, in 1 / spacing of samples.
_CURVATURE = 0.25


@dataclass(frozen=True)
class Stage:
    """A pass over a picture: its samples per pixel, whether it is the last pass, and whether it looks as moving ones.

    In path tracing, the samples of earlier passes are included.
    """

    samples: int
    final: bool
    moving: bool = False


def passes(state):
    """The passes over a state that no longer changes.

    In studio light, the first pass looks as moving pictures do: it is there at once, and shadows would take as long as
    those of the last pass.
    """
    counts = _PASSES.get(state.light, _OTHER_PASSES)
    return [Stage(count, count == counts[-1], state.light == "studio" and count != counts[-1]) for count in counts]


def picture_part(state):
    """The part of a state that its picture shows: no measurements, and of slices only the window of values on a cut."""
    window = {"volume": state.slices.volume, "window": state.slices.window} if state.clip.shows_values else {}
    return state.replace(slices=SliceState(**window), measurements=())


def color_rule(each, document, volume_of):
    """The colour of an object: a name or one of isospline's colour rules, of the volumes ``volume_of(source)``."""
    if each.color_by == "own":
        return document[each.source].rule or each.color
    if each.color_by == "color":
        return each.color
    if each.color_by == "normal":
        return ColorByNormal()
    if each.color_by in CURVATURES:
        kind = CURVATURES[each.color_by]
        return ColorByCurvature(kind, each.cmap, limits=each.limits or default_limits(each, document))
    volume = volume_of(document[each.color_by])
    return ColorByVolume(volume, each.cmap, limits=each.limits or default_limits(each, document))


def default_limits(each, document):
    """The values of the first and the last colour of a map if the state gives none; None without a map."""
    if each.color_by in ("color", "own", "normal"):
        return None
    if each.color_by not in CURVATURES:
        return document[each.color_by].window()
    source = document[each.source]
    most = _CURVATURE / float(np.min(source.item.spacing)) if source.is_volume else 1.0
    return (0.0, most**2) if CURVATURES[each.color_by] == "gaussian" else (-most, most)


def cap_color(state, each, document, volume_of):
    """The colour of caps, by the volumes ``volume_of(source)``; None for the surface's own colour."""
    if not (state.clip.shows_values and each.level is not None):
        return None
    source = document[each.source]
    shown = state.slices
    window = shown.window if shown.window and shown.volume == each.source else source.window()
    return ColorByVolume(volume_of(source), "gray", limits=window)


def _overview(source):
    """The scale of pictures in movement."""
    del source


class PictureMaker:
    """Renders states; each thread has its own.

    Between states, only the differences are applied to the scene: a new level takes milliseconds, a new cut needs a
    new isosurface of the same volume.
    """

    def __init__(self, document):
        self._document = document
        self._scene = Scene([])
        self._objects = {}  # (parameters, object) by its id in the state, in the order of the scene
        # (volume key, scale, level of the body, closed): a surface that owns the index of bricks
        self._indices = {}
        self._scale_of = _overview  # of the last picture
        self._tracing = None  # the path traced state and its renderer

    @property
    def scene(self):
        return self._scene

    @property
    def scales(self):
        """The scales that the last picture used for volumes in stores, by the keys of the volumes."""
        shown = {made_of[:2] for made_of, _ in self._objects.values()}
        stored = {key: detail for key, detail in shown if self._document[key].scales}
        return {
            key: self._document[key].scales.overview if detail is None else detail for key, detail in stored.items()
        }

    def forget_closed(self):
        """Forget what was made of sources that are no longer open."""
        for id, geometry in self._ids().items():
            if self._objects[id][0][0] not in self._document:
                self._scene.remove(geometry)
                del self._objects[id]
        closed = [made_of for made_of in self._indices if made_of[0] not in self._document]
        for made_of in closed:
            del self._indices[made_of]
        if self._tracing is not None and any(key not in self._document for key in self._tracing[0][0].named_sources()):
            self.end_path_tracing()

    def end_path_tracing(self):
        """Forget the path traced picture, which could be continued."""
        self._tracing = None

    @without_warnings()  # a level may be moved to where there is no surface
    def geometry_ids(self, state, scale_of=_overview):
        """The visible objects' geometry ids in the scene, by their ids in the state.

        Volumes of stores have the scale ``scale_of(source)``, or that of the overview if it is None.
        """
        self.forget_closed()
        cuts = None if state.clip.kind == "none" else state.clip
        objects = {}
        self._scale_of = scale_of
        for each in state.objects:
            if not each.is_seen:
                continue
            detail = scale_of(self._document[each.source])
            options = (each.largest, each.body_level, each.closed, cuts)
            made_of = (each.source, detail, None if each.level is None else options)
            known = self._objects.get(each.id)
            item = known[1] if known and known[0] == made_of else self._item(each, state.clip, detail)
            if each.level is not None and item.level != each.level:
                item.level = each.level
            objects[each.id] = (made_of, item)
        self._place([item for _, item in objects.values()])
        self._objects = objects
        return self._ids()

    def _place(self, items):
        """Show these objects, in the order of the state: where caps coincide, the last one is seen."""
        ids = self._scene.ids
        if items != [self._scene.object(id) for id in ids]:
            for id in ids:
                self._scene.remove(id)
            for item in items:
                self._scene.add(item)

    def _ids(self):
        """The geometry ids of the objects, which ascend, by their ids in the state."""
        return dict(zip(self._objects, self._scene.ids))

    def _item(self, each, clip, detail):
        source = self._document[each.source]
        item = source.volume(detail)
        if each.level is None:
            return item
        cuts, mask = clip.cuts(), source.mask(each.body_level, detail)
        options = {**source.given_options, "closed": each.closed}
        if mask is not None or detail is not None:  # a mask that was given is that of the whole volume
            options["mask"] = mask
        known = (each.source, detail, each.body_level, each.closed)
        if known not in self._indices:
            is_whole = source.template and mask is None and source.template.closed == each.closed
            self._indices[known] = source.template if is_whole else Isosurface(item, each.level, **options)
        if cuts is None and each.largest == self._indices[known].largest:
            return self._indices[known].with_level(each.level)
        if cuts is not None:
            options.update(mask=mask, clip=cuts, capped=clip.capped)
        return Isosurface(item, each.level, largest=each.largest, **options)

    def shadings(self, state, ids, moving=False):
        """A shading for each geometry id."""
        return {
            id: _shading(state, material, moving)._taking(material, names_in_shadings(material))
            for id, material in self._materials(state, ids).items()
        }

    def light(self, state, ids, moving=False):
        """The light of a picture, as in the options of `isospline.render`."""
        if state.light == "studio":
            return Studio(fast=moving, materials=self._materials(state, ids))
        if state.light == "path-trace" and not moving:
            return PathTracer(materials=self._materials(state, ids), lights=path_tracing_lights(state.camera))
        return self.shadings(state, ids, moving)

    def look(self, state):
        """The light of the last picture, as in the options of `isospline.render`."""
        return {"light": resolve(self._scene, self.light(state, self._ids()))}

    def _volume_of(self, source):
        """The volume of a source at the scale of the last picture."""
        return source.volume(self._scale_of(source))

    def _materials(self, state, ids):
        """A material for each geometry id."""
        return {ids[each.id]: self._material(state, each) for each in state.objects if each.id in ids}

    def _material(self, state, each):
        """The look of an object in the state; what states do not have is that of the object that was given."""
        look = {"metallic": each.metallic, "roughness": each.roughness}
        if state.light == "path-trace":
            look |= {"opacity": 1.0, "silhouette_opacity": None}
        else:
            look |= {"opacity": each.opacity, "silhouette_opacity": each.silhouette_opacity}
        if (values := cap_color(state, each, self._document, self._volume_of)) is not None:
            look["cap_color"] = values
        color = color_rule(each, self._document, self._volume_of)
        return self._document[each.source].material.replace(color=color, **look)

    def render(self, state, size, stage=None, progress=None, **options):
        """Render a state that has a camera; without a stage, render as during movement."""
        camera = state.camera.camera()
        ids = self.geometry_ids(state, (lambda source: source.scale(camera, size)) if stage else _overview)
        options.setdefault("background", state.background)
        if stage is not None and state.light == "path-trace":
            return self._path_trace(state, ids, size, stage.samples, progress, options)
        self.end_path_tracing()
        return render(
            self._scene,
            camera,
            size=size,
            light=self.light(state, ids, moving=stage is None or stage.moving),
            samples=stage.samples if stage else 1,
            progress=progress,
            **options,
        )

    def _path_trace(self, state, ids, size, samples, progress, options):
        """Path trace; continue from the last pass if the state is the same."""
        tracing = (state, size, tuple(options.items()))
        if self._tracing is None or self._tracing[0] != tracing or self._tracing[1].samples > samples:
            renderer = ProgressiveRenderer(
                self._scene, state.camera.camera(), size=size, light=self.light(state, ids), **options
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
    return [EnvironmentLight(SKY), _lamp(camera, LAMP * math.pi)]


def _shading(state, material, moving):
    """The shading of a light; the materials of the objects determine their looks in it."""
    if state.light == "outline":
        return Outline(state.exponent, color=0.02)
    if state.light == "ambient-occlusion":
        return _occluded_in_motion(state.camera) if moving else AmbientOcclusion()
    if state.light == "path-trace":
        return _traced_in_motion(material, state.camera)
    return Phong(shadows=state.shadows and not moving)


def _occluded_in_motion(camera):
    """About ambient occlusion, at once: from most surfaces, a part of the sky is hidden, the more they turn away."""
    light = DirectionalLight(camera.camera().world_to_camera[2, :3], intensity=1 - _AT_EDGES)
    return Phong(ambient=_AT_EDGES, diffuse=1.0, specular=0.0, lights=[light])


def _traced_in_motion(material, camera):
    """About path tracing, at once: first hits with the lamp's shadows and highlights, and a sky that is partly hidden.

    The height of highlights is that of microfacets in the direction of mirrors, F / (4 alpha^2), and so is their width.
    """
    alpha = max(material.roughness**2, _SHARPEST)
    fresnel = _DIELECTRIC + material.metallic * (_METAL - _DIELECTRIC)
    return Phong(
        ambient=_SEEN_SKY * SKY,
        diffuse=1.0 - material.metallic,
        specular=min(1.0, fresnel / (4 * alpha**2)),
        specular_exponent=max(1.0, (1 / alpha**2 - 1) / 2),
        lights=[_lamp(camera, LAMP)],
        shadows=True,
    )


def _lamp(camera, intensity):
    right, up, forward = camera.camera().world_to_camera[:3, :3]
    return DirectionalLight(forward + LAMP_RIGHT * right + LAMP_UP * up, intensity=intensity)
