"""Parts of scenes: each has some of the bricks of every volume, and reads from its store only the data of these."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..scene import Isosurface, Scene, Volume
from ..scene.public import from_state
from ..scene.scene import scene_of
from ..store.layout import Part
from ..store.volume import reopen

#: Describes a scene: arguments of `scene_of`, with the states of surfaces and the stores of volumes.
Description = tuple[Any, ...]


def describe(scene: Scene) -> Description:
    """The description of a scene whose volumes are all in stores."""
    made_of: Any = scene.__reduce__()[1]
    build_quality, objects = made_of[:2]
    surfaces: dict[int, dict[str, Any]] = {}

    def described(thing):
        if not isinstance(thing, Isosurface):
            return thing
        if id(thing) not in surfaces:
            state = thing.__getstate__()
            store = state["volume"].__getstate__().get("store")
            if store is None:
                raise ValueError("by: expected 'tiles' for a scene with a volume in memory, got 'parts'")
            if state["largest"]:
                raise ValueError("by: expected 'tiles' for a surface that keeps its largest components, got 'parts'")
            surfaces[id(thing)] = state | {"volume": tuple(store)}
        return surfaces[id(thing)]

    return build_quality, [(id, described(thing), *rest) for id, thing, *rest in objects]


class PartOfScene:
    """A part of a scene on a worker. Pickling sends only its description to another worker."""

    def __init__(self, description: Description, part: Part) -> None:
        self._made_of = (description, part)
        build_quality, objects = description
        volumes: dict[Any, Volume] = {}
        surfaces: dict[int, Isosurface] = {}

        def made(state: Any) -> Any:
            if not isinstance(state, dict):
                return state
            if id(state) not in surfaces:
                store = state["volume"]
                if store not in volumes:
                    folder, array, memory_limit = store
                    volumes[store] = reopen(folder, array, memory_limit, part)
                surfaces[id(state)] = from_state(Isosurface, state | {"volume": volumes[store]})
            return surfaces[id(state)]

        objects = [(id, made(state), *rest) for id, state, *rest in objects]
        self.scene = scene_of(build_quality, objects)

    def __reduce__(self) -> Any:
        return PartOfScene, self._made_of


def split(shape: Any, count: int) -> list[Part]:
    """Split a volume of this shape into boxes of about the same size, by repeated cuts across the longest edge."""
    parts: list[tuple[Any, int]] = [(((0.0, 1.0),) * 3, count)]
    done: list[Part] = []
    while parts:
        box, pieces = parts.pop()
        if pieces == 1:
            done.append(box)
            continue
        edges = [(upper - lower) * size for (lower, upper), size in zip(box, shape)]
        axis = int(np.argmax(edges))
        lower, upper = box[axis]
        first = pieces // 2
        middle = lower + (upper - lower) * first / pieces
        for span, share in (((lower, middle), first), ((middle, upper), pieces - first)):
            parts.append((box[:axis] + (span,) + box[axis + 1 :], share))
    return done


def largest_shape(scene: Scene) -> tuple[int, ...]:
    """The shape of the largest volume of a scene, along z, y and x."""
    shapes = [item.volume.shape for _, item, *_ in scene._placed_objects() if isinstance(item, Isosurface)]
    return max(shapes, key=np.prod, default=(1, 1, 1))
