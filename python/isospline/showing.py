"""What every object with a picture has: `_repr_png_` for notebooks, `show` for the viewer, and `save` for files."""

from __future__ import annotations

import os

from ._core import Isosurface, Mesh, Scene, Volume
from .base.foreign import answer
from .base.parameters import check_path, printable
from .base.results import SurfaceDistance
from .base.signatures import explained
from .cameras import PerspectiveCamera
from .interop.mesh_output import MESHES
from .io.volume_data import VolumeData
from .picture.image import Image

#: Suffixes of pictures.
PICTURES = (".png", ".exr", ".npz", ".jpg", ".jpeg")


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


def save(self, path, *arguments, **options):
    """Write a picture of it, ``isospline.render(self, ...).save(path)``, or its mesh, ``write(path, ...)``.

    Parameters
    ----------
    path : str or path-like
        Ends in ``.png``, ``.exr``, ``.npz``, ``.jpg`` or ``.jpeg`` for a picture. Of isosurfaces and meshes it may also
        end in ``.stl``, ``.ply``, ``.obj``, ``.glb`` or ``.3mf``.
    *arguments, **options
        Those of `isospline.render`, or those of `write`.

    Raises
    ------
    ValueError
        For another suffix.
    """
    check_path(path)
    suffix = os.path.splitext(os.fspath(path))[1].lower()
    if suffix in PICTURES:
        from .picture.rendering import render

        render(self, *arguments, **options).write(path)
        return
    if isinstance(self, (Isosurface, Mesh)):
        if suffix not in MESHES:
            expected = ", ".join((*MESHES, *PICTURES))
            raise ValueError(f"path: expected a name that ends in {expected}, got {printable(path)!r}")
        self.write(path, *arguments, **options)
        return
    hint = ""
    if suffix in MESHES:
        made = "to_mesh() of its isosurfaces" if isinstance(self, Scene) else "Isosurface(volume, level)"
        hint = f"; did you mean {made}, which have save({printable(path)!r})?"
    raise ValueError(
        f"path: expected a name that ends in {', '.join(PICTURES)} for a picture, got {printable(path)!r}{hint}"
    )


def _attach(owner, **functions):
    for name, function in functions.items():
        setattr(owner, name, function)


for _class in (Scene, Isosurface, Mesh, Volume, VolumeData):
    _attach(_class, _repr_png_=_repr_png_, show=show, save=explained(save))
_attach(Mesh, export=Mesh.save)
answer(Scene, Isosurface, Mesh, Volume, VolumeData, Image, PerspectiveCamera, SurfaceDistance)
