"""`isospline.view`."""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import Any

import numpy as np

from .. import _core
from ..parameters import check_count, check_type
from ..signatures import explained
from .cell import display, in_notebook
from .checked import number
from .viewer import Viewer, open_in_browser


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
) -> Viewer:
    """Show volumes, isosurfaces and meshes in a web browser, or in the cell of a notebook.

    The viewer works on a thread of its own and goes on until it is closed, or the program ends.

    Parameters
    ----------
    *items : path-like, Volume, VolumeData, Isosurface, Mesh, Scene or array
        Files, as `read_volume` and `read_mesh` take them, and objects. Isosurfaces and meshes of a scene must have no
        transform.
    levels : sequence of float, optional
        Levels of volumes; by default the first one of `suggest_levels`.
    host : str
        The address to listen on; by default that of this machine alone. At any other the page needs a token, which is a
        part of the viewer's `url`.
    port : int
        0 takes any that is free.
    token : str, optional
        In place of a random one.
    browser : bool, optional
        Open a browser; by default where this is no notebook.
    session : path-like, optional
        A session that the viewer saved, to go on with.
    height : int
        Pixels of the view in a notebook.

    Returns
    -------
    Viewer
        ``.url`` is the address, ``.wait()`` waits until ``.close()``, and so does ``with``.

    Raises
    ------
    ImportError
        Without the package websockets: ``pip install isospline[view]``.
    OSError, ValueError
        For a file that cannot be read and a port that is taken.

    Examples
    --------
    >>> import isospline
    >>> field = isospline.volumes.torus()
    >>> volume = isospline.Volume(field.samples(32), **field.grid(32))
    >>> with isospline.view(volume, levels=[field.level], browser=False) as viewer:
    ...     viewer.state.objects[0].level == field.level
    True
    """
    if levels is not None:
        check_type(levels, "levels", Iterable, "numbers")
        levels = [number()(level, "levels") for level in levels]
    check_count(height, "height")
    viewer = Viewer(host=host, port=port, token=token)
    try:
        if session is not None:
            from .session import read_session

            viewer.open_session(read_session(session))
        for item in items:
            _show(viewer, item, levels)
    except BaseException:
        viewer.close()
        raise
    notebook = in_notebook()
    if notebook:
        display(viewer, height)
    if browser or (browser is None and not notebook):
        open_in_browser(viewer.url)
    return viewer


def _show(viewer, item, levels):
    if isinstance(item, (str, os.PathLike)):
        viewer.open(item, levels=levels)
    elif isinstance(item, _core.Scene):
        for id in item.ids:
            if not np.array_equal(item.transform(id), np.eye(4)):
                raise ValueError(f"scene: expected objects without a transform, got one of geometry {id}")
            viewer.add(item.object(id))
    else:
        viewer.add(item, levels=levels)
