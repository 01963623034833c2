"""How objects are shown and saved: what `base.shown.Shown` calls."""

from __future__ import annotations

import os

from .base.foreign import answer
from .base.handed import handed
from .base.parameters import check_path, printable
from .base.results import SurfaceDistance
from .cameras import PerspectiveCamera
from .interop.mesh_output import MESHES
from .io.volume_data import VolumeData
from .picture.image import Image
from .scene import Isosurface, Mesh, Scene, Volume

#: Suffixes of pictures.
PICTURES = (".png", ".exr", ".npz", ".jpg", ".jpeg")


@handed
def picture_in_cell(shown):
    """The PNG of an object that is the last expression of a cell of a notebook.

    None of what has no picture, such as samples that are NaN: the cell then shows its `repr`, in place of an error.
    """
    from .viewer.cell import picture

    try:
        return picture(shown)._repr_png_()
    except (ValueError, TypeError, MemoryError):
        return None


@handed
def show_in_viewer(shown, **options):
    """The viewer of an object."""
    from .viewer import view

    return view(shown, **options)


@handed
def save_picture_or_mesh(shown, path, *arguments, **options):
    """Write the picture or the mesh of an object, as the suffix says."""
    check_path(path)
    suffix = os.path.splitext(os.fspath(path))[1].lower()
    if suffix in PICTURES:
        from .picture.rendering import render

        render(shown, *arguments, **options).write(path)
        return
    if isinstance(shown, (Isosurface, Mesh)):
        if suffix not in MESHES:
            expected = ", ".join((*MESHES, *PICTURES))
            raise ValueError(f"path: expected a name that ends in {expected}, got {printable(path)!r}")
        shown.write(path, *arguments, **options)
        return
    hint = ""
    if suffix in MESHES:
        made = "to_mesh() of its isosurfaces" if isinstance(shown, Scene) else "Isosurface(volume, level)"
        hint = f"; did you mean {made}, which have save({printable(path)!r})?"
    raise ValueError(
        f"path: expected a name that ends in {', '.join(PICTURES)} for a picture, got {printable(path)!r}{hint}"
    )


answer(Scene, Isosurface, Mesh, Volume, VolumeData, Image, PerspectiveCamera, SurfaceDistance)
