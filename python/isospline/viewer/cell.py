"""Pictures of objects in the cells of notebooks, and the viewer in them."""

from __future__ import annotations

import base64
import html
import json
import threading

import numpy as np

from ..picture.cameras import camera_for
from ..picture.rendering import render
from ..picture.scenes import as_scene
from ..picture.views import SIZE


def in_notebook():
    """Whether this process is the kernel of a notebook."""
    try:
        from IPython import get_ipython
    except ImportError:
        return False
    shell = get_ipython()
    return shell is not None and getattr(shell, "kernel", None) is not None


def picture(item):
    """The image of an object that a notebook shows."""
    scene = as_scene(item)
    is_seen = np.isfinite(scene.extent(np.eye(3))).all()
    return render(scene, None if is_seen else camera_for([[-1] * 3, [1] * 3]))


def display(viewer, height):
    """Show a viewer in a cell: interactive if the browser can reach the kernel, otherwise a picture of its state."""
    from IPython.display import HTML
    from IPython.display import display as display_in_cell

    display_in_cell(HTML(cell(viewer, height)))


def cell(viewer, height):
    """HTML with a picture. The viewer's page replaces it as soon as the viewer answers."""
    from .picture import PictureMaker, Stage

    state = viewer.state
    image = ""
    if state.objects:
        state = state.replace(camera=viewer.camera_towards("home", SIZE))
        drawn = PictureMaker(viewer.document).render(state, SIZE, Stage(4, False), encoding="srgb8")
        image = f"data:image/png;base64,{base64.b64encode(drawn._repr_png_()).decode()}"
    id = f"isospline-{threading.get_ident():x}-{viewer.address.rsplit(':', 1)[1].strip('/')}"
    url, alive = json.dumps(viewer.stored_url), json.dumps(f"{viewer.address}alive")
    return f"""<div id="{id}"><img src="{image}" alt="isosurfaces" style="max-width: 100%"></div>
<script>
fetch({alive}, {{mode: "no-cors"}}).then(() => {{
  const frame = document.createElement("iframe");
  frame.src = {url};
  frame.style = "width: 100%; height: {int(height)}px; border: 0";
  document.getElementById({html.escape(json.dumps(id), quote=False)}).replaceChildren(frame);
}}).catch(() => {{}});
</script>"""
