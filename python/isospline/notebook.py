"""What notebooks show of objects: `_repr_png_`, and `show()`, which opens the viewer."""

from __future__ import annotations

from ._core import Isosurface, Scene, Volume


def _repr_png_(self):
    """The picture of a cell whose last expression this is."""
    from .viewer.cell import picture

    return picture(self)._repr_png_()


def show(self, **options):
    """Show it in a web browser, or in the cell of a notebook: ``isospline.view(self, **options)``.

    Needs ``pip install isospline[view]``.

    Parameters
    ----------
    **options
        Of `isospline.view`.

    Returns
    -------
    Viewer
    """
    from .viewer import view

    return view(self, **options)


for _class in (Scene, Isosurface, Volume):
    _class._repr_png_ = _repr_png_
    _class.show = show
