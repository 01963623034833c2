"""The camera that shows all objects of a state from a side, for pages, notebooks and sessions."""

from __future__ import annotations

import numpy as np

from ..picture.cameras import camera_for
from ..suggest.view import SuggestedView
from .state import CameraState

#: The margin around the objects in a window, with space for the handles of cuts, the cube and the scale bar.
MARGIN = 0.2


def camera_towards(document, maker, state, view, size, projection="perspective", field_of_view=30.0, up=None):
    """The state of a camera that shows all objects of a state from a side; "home" is the suggested view."""
    seen = maker.scene if maker.geometry_ids(state) else document.bounds()
    if seen is maker.scene and not np.isfinite(seen.bounds).all():
        seen = document.bounds()
    suggested = _suggested_view(document, state) if view == "home" else None
    camera = camera_for(
        seen,
        view=view if suggested is None else suggested.view,
        up=up if suggested is None else suggested.up,
        projection=projection,
        field_of_view=field_of_view,
        size=size,
        margin=MARGIN,
    )
    return CameraState.of(camera, field_of_view)


def _suggested_view(document, state):
    """The view suggested for the only volume that is seen, or the usual one."""
    seen = {each.source for each in state.objects if each.is_seen and each.level is not None}
    return document[min(seen)].presentation.view if len(seen) == 1 else SuggestedView()
