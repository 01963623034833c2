"""Undo and redo: the states before and after the displayed one."""

from __future__ import annotations

import time
from collections import deque
from dataclasses import fields
from itertools import pairwise

from .state import ViewState

#: States that can be returned to.
LIMIT = 500
#: Seconds within which changes of the same things are one step: those of a drag.
ONE_STEP = 1.0


class History:
    """The states that undo and redo return to; the caller locks it."""

    def __init__(self, clock=time.monotonic):
        self._clock = clock
        self._past: deque[ViewState] = deque(maxlen=LIMIT)
        self._future: list[ViewState] = []
        self._last, self._time = None, 0.0  # what was changed last, and when

    def record(self, before, after):
        """Record a change; quick changes of the same things are one step."""
        what = changed(before, after)
        if not what:
            return
        now = self._clock()
        if not self._past or what != self._last or now - self._time > ONE_STEP:
            self._past.append(before)
        elif after == self._past[-1]:
            self._past.pop()
            what = None  # the next change is a step of its own, not a part of the one before
        self._future.clear()
        self._last, self._time = what, now

    @property
    def can_undo(self):
        return bool(self._past)

    @property
    def can_redo(self):
        return bool(self._future)

    def undo(self, present):
        """The state before the last step; the present one if there is none."""
        return self._moved(self._past, self._future, present)

    def redo(self, present):
        """The state after the step that was undone last; the present one if there is none."""
        return self._moved(self._future, self._past, present)

    def replace(self, function, present):
        """Replace all states by ``function(state)``; steps that change nothing any more are left out."""
        for states in (self._past, self._future):
            changed = [*map(function, states), present]
            states.clear()
            states.extend(each for each, after in pairwise(changed) if each != after)
        self._last = None

    def _moved(self, source, target, present):
        self._last = None
        if not source:
            return present
        target.append(present)
        return source.pop()


def changed(before, after):
    """The names of what differs between two states; those of objects have the object's id."""
    names: set[object] = set(differing(before, after))
    for part in ("clip", "slices"):
        if part in names:
            names.remove(part)
            names |= {(part, name) for name in differing(getattr(before, part), getattr(after, part))}
    if "measurements" in names:  # each point is a step
        names.remove("measurements")
        different = set(before.measurements) ^ set(after.measurements)
        names |= {("measurement", each.id, len(each.points)) for each in different}
    if "objects" in names:
        names.remove("objects")
        old, new = ({each.id: each for each in state.objects} for state in (before, after))
        for id in old.keys() | new.keys():
            if id in old and id in new:
                names |= {(id, name) for name in differing(old[id], new[id])}
            else:
                names.add((id, "added" if id in new else "removed"))
    return names


def differing(before, after):
    """The names of the fields that differ between two records."""
    return [each.name for each in fields(before) if getattr(before, each.name) != getattr(after, each.name)]
