"""Colour rules that depend on the objects which they colour, completed for a scene."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..color_rules import ColorByDistance, ColorByThickness, ColorByValue, ColorByVolume
from ..color_rules.rule import _ColorRule, _MeasuredRule
from ..looks import Material
from ..scene import Isosurface, Mesh, Scene
from ..scene.world_units import check_unit, converts, unit_when_placed, world_unit

#: An object and its transform.
Placed = tuple[Any, NDArray[np.float64]]

# Points of an object for the limits of its distances or its thickness, and the part of them within.
_POINTS, _WITHIN = 500, 0.98


def own_material(item: Any) -> Material | None:
    """The material of an object. The colour of a mesh with different values and no colour is by its values."""
    material: Material | None = item.material
    has_no_color = material is None or material.color is None
    is_bare = isinstance(item, Mesh) and item._colors() is None and has_no_color
    if is_bare and item.values is not None and _differ(item.values):
        return (material or Material()).replace(color=ColorByValue())
    return material


def depends_on_object(rule: Any) -> bool:
    """Whether a colour is a rule that is not complete without an object."""
    is_of_any = isinstance(rule, ColorByThickness) and rule.surface is None
    return is_of_any or (isinstance(rule, _MeasuredRule) and rule.limits is None)


def without_object(rule: Any) -> Any:
    """What a colour bar shows of a complete rule, which is the same for several objects."""
    return rule.replace(surface=None, transform=None) if isinstance(rule, ColorByThickness) else rule


def is_incomplete(look: Any) -> bool:
    """Whether a material or a shading has a rule that depends on the object."""
    return look is not None and any(map(depends_on_object, _rules(look).values()))


def completed(looks: Mapping[int, Any], items: Mapping[int, Placed]) -> dict[int, Any]:
    """Materials or shadings of objects, by geometry id, with complete rules. Objects with one rule share its limits."""
    found = dict(looks)
    for id, look in looks.items():
        changes = {}
        for name, rule in _rules(look).items():
            if depends_on_object(rule):
                peers = [items[other] for other, each in looks.items() if rule in _rules(each).values()]
                changes[name] = _COMPLETED[type(rule)](rule, items[id], peers)
        if changes:
            found[id] = look.replace(**changes)
    return found


def rules_of(look: Any) -> dict[str, _ColorRule]:
    """The rules among the colours of a material or a shading, by parameter."""
    return {name: rule for name, rule in vars(look).items() if isinstance(rule, _ColorRule)}


def check_units(scene: Scene, looks: Iterable[Any]) -> None:
    """Raise an error if a rule of a material or a shading measures in another unit of length than that of the scene."""
    unit = world_unit(scene)
    for rule in {id(rule): rule for look in looks for rule in rules_of(look).values()}.values():
        check_unit(_unit_of(rule), unit, "color", "the scene is", "a rule")


def _unit_of(rule):
    """The unit of the world in which a rule measures; empty if it is not known."""
    if isinstance(rule, ColorByDistance):
        return world_unit(rule._index.scene)
    if isinstance(rule, ColorByVolume):
        return "" if converts(rule.transform) else rule.volume.unit
    if isinstance(rule, ColorByThickness) and (surface := rule.surface) is not None:
        return unit_when_placed(surface, rule.transform)
    return ""


def _rules(look):
    return {name: rule for name, rule in rules_of(look).items() if isinstance(rule, _MeasuredRule)}


def _differ(values):
    """Whether there is NaN or different finite numbers: contours of PyVista have the level at each vertex."""
    finite = values[np.isfinite(values)]
    return bool(np.isnan(values).any() or (finite.size > 0 and finite.min() < finite.max()))


def _by_value(rule, placed, peers):
    """A rule by values with limits, and with the name of the values of an object."""
    item, _ = placed
    named = [each for each, _ in peers if isinstance(each, Mesh) and each.values is not None]
    label = rule.label
    if item in named:
        named = [each for each in named if each.values_name == item.values_name]
        label = label or item.values_name
    return rule.replace(limits=_range(each.values for each in named), label=label)


def _by_distance(rule, placed, peers):
    """A rule by distance with limits between which most points of each object are."""
    most = 0.0
    for item, transform in peers:
        points = _points_of(item) @ transform[:3, :3].T + transform[:3, 3]
        if len(points):
            most = max(most, float(np.quantile(rule._distances(points), _WITHIN)))
    most = most or 1.0
    return rule._within((-most if rule.signed else 0.0, most))


def _points_of(item):
    """Some points of an object, in its own world; none if it has none."""
    if isinstance(item, Mesh):
        used = item.vertices[np.unique(item.faces)]
        return used[:: -(-len(used) // _POINTS) or 1]
    if not np.isfinite(Scene([item]).extent(np.eye(3))).all():
        return np.zeros((0, 3))
    return item.sample_points(_POINTS)["points"]


def _by_thickness(rule, placed, peers):
    """A rule by thickness with limits, and with a surface: that of the rule, or the object itself."""
    own = placed if rule.surface is None else (rule.surface, rule.transform)
    if not isinstance(own[0], Isosurface):
        raise ValueError("color: expected ColorByThickness(surface=...) for a mesh, got one without a surface")
    limits = rule.limits or _thickness_limits(rule, [own] if rule.surface is not None else peers)
    return rule.replace(surface=own[0], transform=own[1], limits=limits)


def _thickness_limits(rule, surfaces):
    """From 0 to the thickness below which most points of each surface are."""
    most = 0.0
    for surface, transform in surfaces:
        if not isinstance(surface, Isosurface) or not len(points := _points_of(surface)):
            continue
        thickness = surface.thickness(points, method=rule.method, ripple=rule.ripple)
        if (finite := thickness[np.isfinite(thickness)]).size:
            scale = np.cbrt(abs(np.linalg.det(transform[:3, :3])))
            most = max(most, float(scale * np.quantile(finite, _WITHIN)))
    return 0.0, most or 1.0


def _range(arrays: Iterable[Any]) -> tuple[float, float]:
    """The smallest and the largest finite number, or limits around it if there is only one."""
    finite = [each for array in arrays if (each := array[np.isfinite(array)]).size]
    if not finite:
        return 0.0, 1.0
    lower, upper = min(float(each.min()) for each in finite), max(float(each.max()) for each in finite)
    half = 0.0 if lower < upper else max(abs(lower), 1.0) / 2
    return lower - half, upper + half


_COMPLETED = {
    ColorByDistance: _by_distance,
    ColorByValue: _by_value,
    ColorByThickness: _by_thickness,
}
