"""Display of objects in notebooks: `_repr_png_`, and `show()`, which opens the viewer."""

from __future__ import annotations

from ._core import Isosurface, Scene, Volume


def _repr_png_(self):
    """The picture of the object if it is the last expression of a cell."""
    from .viewer.cell import picture

    return picture(self)._repr_png_()


def show(self, **options):
    """Show it in a web browser, or in the cell of a notebook: ``isospline.view(self, **options)``.

    Needs ``pip install isospline[view]``.

    Parameters
    ----------
    **options
        Options of `isospline.view`.

    Returns
    -------
    Viewer
    """
    from .viewer import view

    return view(self, **options)


for _class in (Scene, Isosurface, Volume):
    for _method in (_repr_png_, show):
        setattr(_class, _method.__name__, _method)
