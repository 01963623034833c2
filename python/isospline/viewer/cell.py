"""Pictures of objects in the cells of notebooks, and the viewer in them."""

from __future__ import annotations

import base64

import numpy as np

from ..base.views import SIZE
from ..picture.cameras import camera_for
from ..picture.rendering import render
from ..picture.scenes import as_scene


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
    """Show a viewer in a cell; without anywidget, a picture of its state, and its address."""
    from IPython.display import HTML
    from IPython.display import display as display_in_cell

    try:
        from .widget import ViewerWidget
    except ImportError:
        image = f'<img src="{still(viewer)}" alt="isosurfaces" style="max-width: 100%">'
        note = "The viewer is at its <code>.url</code>; <code>pip install isospline[view]</code> puts it into the cell."
        display_in_cell(HTML(f"{image}<p>{note}</p>"))
    else:
        display_in_cell(ViewerWidget(viewer, still(viewer), height))


def still(viewer):
    """A picture of a viewer's state, as an address with the data; empty if nothing is shown."""
    from .picture import PictureMaker, Stage

    state = viewer.state
    if not state.objects:
        return ""
    state = state.replace(camera=state.camera or viewer.camera_towards("home", SIZE))
    drawn = PictureMaker(viewer.document).render(state, SIZE, Stage(4, True), encoding="srgb8")
    return f"data:image/png;base64,{base64.b64encode(drawn._repr_png_()).decode()}"
