"""`isospline.view`."""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import Any

from ..base.parameters import check_count, check_type
from ..base.signatures import explained
from ..scene import Isosurface, Mesh, Scene
from .cell import display, in_notebook
from .checked import number
from .document import is_mesh
from .placed import Placement
from .upload import UPLOAD_COUNT, UPLOAD_LIMIT
from .viewer import Viewer


@explained
def view(
    *items: Any,
    levels: Iterable[float] | None = None,
    host: str = "127.0.0.1",
    port: int = 0,
    token: str | None = None,
    browser: bool | None = None,
    session: str | os.PathLike[str] | None = None,
    height: int = 640,
    upload_limit: int | str = UPLOAD_LIMIT,
    upload_count: int = UPLOAD_COUNT,
) -> Viewer:
    """Show volumes, isosurfaces and meshes in a web browser, or in the cell of a notebook.

    The viewer runs on its own thread until it is closed or the program ends.

    Parameters
    ----------
    *items : path-like, Volume, VolumeData, Isosurface, Mesh, Scene or array
        Files that `read_volume` and `read_mesh` can read, and objects. Objects of a scene are shown with their
        transforms: the volume of a transformed isosurface is copied into the scene's world. Cuts, slices and positions
        use that world. Isosurfaces and meshes have their own look, as in `render`.
    levels : sequence of float, optional
        Levels of volumes; by default the first one of `suggest_levels`, of a patient's CT the first above water.
    host : str
        The address to listen on; by default only this machine can connect.
    port : int
        0 takes any free port.
    token : str, optional
        What a browser must know to connect: a part of the viewer's `url`, in ASCII without spaces. By default, that of
        the environment variable ISOSPLINE_TOKEN, or a random one.
    browser : bool, optional
        Whether to open a browser; by default, only outside notebooks.
    session : path-like, optional
        A saved session of the viewer to continue, ``session.json`` or ``session.zip``.
    height : int
        The height of the view in a notebook, in pixels.
    upload_limit : int or str
        The most bytes of all files that pages upload together, or a text such as "2GB".
    upload_count : int
        The largest number of these files.

    Returns
    -------
    Viewer
        ``.url`` is the address. ``.wait()`` waits until ``.close()``. A ``with`` statement closes it.

    Raises
    ------
    ImportError
        Without the package websockets: ``pip install isospline[view]``.
    OSError, ValueError
        For a file that cannot be read, a port that is in use, and a parameter out of range.

    Examples
    --------
    >>> import isospline
    >>> field = isospline.volumes.torus()
    >>> volume = field.volume(32)
    >>> with isospline.view(volume, levels=[field.level], browser=False) as viewer:
    ...     viewer.state.objects[0].level == field.level
    True
    """
    if levels is not None:
        check_type(levels, "levels", Iterable, "numbers")
        levels = [number()(level, "levels") for level in levels]
        if items and not any(_takes_levels(item, levels) for item in items):
            raise ValueError("levels: expected volumes or files of volumes for them, got none")
    check_count(height, "height")
    check_type(session, "session", (str, os.PathLike, type(None)), "a str, path-like or None")
    viewer = Viewer(host=host, port=port, token=token, upload_limit=upload_limit, upload_count=upload_count)
    try:
        if session is not None:
            viewer.open_session(*viewer.read_session(session))
        for item in items:
            _show(viewer, item, levels)
    except BaseException:
        viewer.close()
        raise
    notebook = in_notebook()
    if notebook:
        display(viewer, height)
    if browser or (browser is None and not notebook):
        viewer.open_in_browser()
    return viewer


def _takes_levels(item, levels):
    """Whether an item is shown at some levels, or at the only one, which is its own."""
    if isinstance(item, Isosurface):
        return levels == [item.level]
    is_file = isinstance(item, (str, os.PathLike))
    return not (is_mesh(os.fspath(item)) if is_file else isinstance(item, (Mesh, Scene)))


def _show(viewer, item, levels):
    if isinstance(item, (str, os.PathLike)):
        viewer.open(item, levels=levels)
    elif isinstance(item, Scene):
        placed = Placement()
        for _, shown, transform, visibility in item._placed_objects():
            viewer.add(placed(shown, transform), visible=visibility.visible)
    else:
        viewer.add(item, levels=levels)
