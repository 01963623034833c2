"""The light of a picture: which look each object of a scene has in it."""

from __future__ import annotations

import numbers
from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

from .. import _core
from ..base.handed import family
from ..base.mistakes import described, sentence
from ..base.system import warn
from ..colors import color_of
from ..looks import AmbientOcclusion, Material, Outline, Phong
from ..looks.shadings import _Shading
from ..scene import Isosurface, Mesh, Scene
from .environments import EnvironmentLight, upright
from .materials import UNLIT, is_translucent, names_in_shadings
from .path_tracer import PathTracer
from .rules import Placed, check_units, completed, is_incomplete, own_material
from .studio import Studio

if TYPE_CHECKING:
    from ..base.types import Color

_OBJECTS = (Isosurface, Mesh)

#: Lights with their defaults, by the names that --light of the command has.
NAMED: dict[str, Any] = {
    "studio": Studio,
    "phong": Phong,
    "unlit": partial(Phong, **UNLIT),
    "outline": Outline,
    "ambient-occlusion": AmbientOcclusion,
    "path-trace": PathTracer,
}

Light = Any  # what `render` takes
#: A light with a look for each object: shadings by geometry id, or one for all.
Resolved = Any


def resolve(scene: Scene, light: Light, color: Color | None = None, opacity: float | None = None) -> Resolved:
    """The light with the looks of all objects of a scene.

    The look of an object is, in this order: what a dict of lights or materials says about it; `color` and `opacity`;
    its own material; for a mesh, the values at its vertices; that of the light. Rules that depend on the object are
    completed. The result may be resolved again, which changes nothing.

    Returns
    -------
    Phong, Outline, AmbientOcclusion, dict of geometry id to one of them, Studio or _core.PathTracer
    """
    light = Studio() if light is None else named(light)
    changes = {name: value for name, value in (("color", color), ("opacity", opacity)) if value is not None}
    if isinstance(light, Studio):
        return light.replace(materials=_materials(scene, light, changes))
    if isinstance(light, PathTracer):
        materials = _materials(scene, light, changes)
        for id, each in materials.items():
            if is_translucent(each):
                warn(f"light: a PathTracer draws all surfaces opaque, also object {id} with its opacity")
        return light._compiled(materials)
    if isinstance(light, _core.PathTracer):
        return light
    given: dict[int, _Shading] = {}
    if isinstance(light, Mapping):
        if changes:
            raise ValueError(
                f"{min(changes)}: cannot be combined with a dict of lights, which have colours of their own"
            )
        lights = by_geometry_id(scene, light, "light")
        given, light = {id: named(each) for id, each in lights.items()}, Phong()
    for each in (*given.values(), light):
        if not isinstance(each, _Shading):
            raise TypeError(sentence("light", _expected() if each is light else "shadings in the dict", each))
    items = _items(scene)
    own = _own(items)
    if not (given or own or changes or is_incomplete(light)):
        check_units(scene, [light])
        return light
    shadings = {id: _shaded(light, own.get(id), changes) for id in items} | given
    check_units(scene, shadings.values())
    return completed(shadings, items)


def _expected() -> str:
    shadings = ", ".join(f"{'an' if name[0] in 'AEIO' else 'a'} {name}" for name in family("_Shading"))
    return f"a Studio, {shadings}, a PathTracer or a dict of objects to shadings"


def named(light: Light) -> Light:
    """The light of a name; anything else as it is."""
    if not isinstance(light, str):
        return light
    if light not in NAMED:
        raise ValueError(sentence("light", f"one of {', '.join(NAMED)}, or a light", light))
    return NAMED[light]()


def in_environment(light: Light, environment: Any, up: Any) -> PathTracer:
    """A path tracer in the light of an environment, which stands upright."""
    path_tracer = PathTracer(lights=[]) if light is None else named(light)
    if not isinstance(path_tracer, PathTracer):
        raise ValueError(f'environment: expected light="path-trace" or a PathTracer with it, got {described(light)}')
    own = [] if path_tracer.lights == [EnvironmentLight()] else list(path_tracer.lights or ())
    if any(isinstance(each, EnvironmentLight) for each in own):
        raise ValueError("environment: expected a PathTracer without an EnvironmentLight with it, got one that has it")
    return path_tracer.replace(lights=[*own, upright(environment, up)])


def _materials(scene: Scene, light: Studio | PathTracer, changes: dict[str, Any]) -> dict[int, Material]:
    """The material of each object that differs from that of the light."""
    given = by_geometry_id(scene, light.materials, "materials")
    items = _items(scene)
    found = _own(items)
    if isinstance(light, Studio) and light.material is None:
        for place, (id, (item, _)) in enumerate(items.items()):
            material = found.get(id, Material())
            has_colors = isinstance(item, Mesh) and item._colors() is not None  # at its vertices
            if material.color is None and not has_colors:
                found[id] = material.replace(color=color_of(place))
    if changes:
        found = {id: found.get(id, light.material or Material()).replace(**changes) for id in items}
    found |= given
    if light.material and is_incomplete(light.material):
        found = dict.fromkeys(items, light.material) | found
    check_units(scene, [*found.values(), *([light.material] if light.material else ())])
    return completed(found, items)


def _items(scene: Scene) -> dict[int, Placed]:
    return {id: (item, transform) for id, item, transform, _ in scene._placed_objects()}


def _own(items: dict[int, Placed]) -> dict[int, Material]:
    materials = {id: own_material(item) for id, (item, _) in items.items()}
    return {id: material for id, material in materials.items() if material is not None}


def _shaded(shading: _Shading, material: Material | None, changes: dict[str, Any]) -> _Shading:
    """A shading with the look of a material, and with changes of it."""
    if material is not None:
        shading = shading._taking(material, names_in_shadings(material))
    if not changes:
        return shading
    return shading.replace(
        **{shading._surface_parameter if name == "color" else name: each for name, each in changes.items()}
    )


def by_geometry_id(scene: Scene, of_objects: Mapping[Any, Any], parameter: str) -> dict[int, Any]:
    """The values for geometry ids of a mapping from objects or geometry ids."""
    of_ids = {key: value for key, value in of_objects.items() if not isinstance(key, _OBJECTS)}
    given = {id(key): value for key, value in of_objects.items() if isinstance(key, _OBJECTS)}
    if given:
        shown = {geometry_id: id(item) for geometry_id, item, *_ in scene._placed_objects()}
        if not given.keys() <= set(shown.values()):
            raise ValueError(f"{parameter}: expected isosurfaces and meshes of the scene, got one that is not in it")
        of_ids = {key: given[each] for key, each in shown.items() if each in given} | of_ids
    for key in of_ids:
        if not isinstance(key, numbers.Integral):
            raise TypeError(sentence(parameter, "objects or their geometry ids in the dict", key))
        if key not in scene:
            raise ValueError(f"{parameter}: expected geometry ids of objects in the scene, got {key!r}")
    return of_ids
