"""Pictures of objects in the cells of notebooks, and the viewer in them."""

from __future__ import annotations

import base64
import html
import json
import threading

import numpy as np

from .. import _core
from ..cameras import camera_for
from ..rendering import render
from .document import source_of
from .state import COLORS

#: Width and height of the picture of an object.
SIZE = (640, 480)


def in_notebook():
    """Whether the program is the kernel of a notebook."""
    try:
        from IPython import get_ipython
    except ImportError:
        return False
    shell = get_ipython()
    return shell is not None and getattr(shell, "kernel", None) is not None


def picture(item):
    """The image of a Scene, an Isosurface or a Volume that a notebook shows."""
    from .picture import linear

    if isinstance(item, _core.Volume):
        source = source_of(item)("volume")
        item = _core.Isosurface(item, (source.suggested_levels() or [source.range[0]])[0])
    scene = item if isinstance(item, _core.Scene) else _core.Scene([item])
    bounds = np.asarray(scene.bounds)
    if not (np.isfinite(bounds).all() and (bounds[0] <= bounds[1]).all()):
        bounds = np.array([[-1.0] * 3, [1.0] * 3])
    shading = {id: _core.Phong(color=linear(COLORS[place % len(COLORS)])) for place, id in enumerate(scene.ids)}
    return render(
        scene, camera_for(bounds, size=SIZE), size=SIZE, shading=shading, samples=4, background=linear("#e8ebef"),
        encoding="srgb8",
    )  # fmt: skip


def display(viewer, height):
    """Show a viewer in a cell: alive where the kernel is within reach, and otherwise the picture of its state."""
    from IPython.display import HTML
    from IPython.display import display as display_in_cell

    display_in_cell(HTML(cell(viewer, height)))


def cell(viewer, height):
    """HTML with a picture, which gives way to the viewer's page once that has answered."""
    from .picture import PictureMaker, Stage

    state = viewer.state
    image = ""
    if state.objects:
        state = state.replace(camera=viewer.camera_towards("home", SIZE))
        drawn = PictureMaker(viewer.document).render(state, SIZE, Stage(4, False), encoding="srgb8")
        image = f"data:image/png;base64,{base64.b64encode(drawn._repr_png_()).decode()}"
    id = f"isospline-{threading.get_ident():x}-{viewer.url.rsplit(':', 1)[1].split('/')[0]}"
    url, alive = json.dumps(viewer.url), json.dumps(viewer.url.split("?")[0] + "alive")
    return f"""<div id="{id}"><img src="{image}" alt="isosurfaces" style="max-width: 100%"></div>
<script>
fetch({alive}, {{mode: "no-cors"}}).then(() => {{
  const frame = document.createElement("iframe");
  frame.src = {url};
  frame.style = "width: 100%; height: {int(height)}px; border: 0";
  document.getElementById({html.escape(json.dumps(id), quote=False)}).replaceChildren(frame);
}}).catch(() => {{}});
</script>"""
