"""What objects with a picture have."""

from __future__ import annotations

from os import PathLike
from typing import TYPE_CHECKING, Any

from .handed import known
from .signatures import explained_methods

if TYPE_CHECKING:
    from ..viewer import Viewer


@explained_methods
class Shown:
    """The part of volumes, surfaces, meshes and scenes about their pictures."""

    __slots__ = ()

    def _repr_png_(self) -> bytes | None:
        """The picture of the object if it is the last expression of a cell; None if it has none."""
        return known("picture_in_cell")(self)

    def show(self, **options: Any) -> Viewer:
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
        return known("show_in_viewer")(self, **options)

    def save(self, path: str | PathLike[str], *arguments: Any, **options: Any) -> None:
        """Write a picture of it, ``isospline.render(self, ...).save(path)``, or its mesh, ``write(path, ...)``.

        Parameters
        ----------
        path : str or path-like
            Ends in ``.png``, ``.exr``, ``.npz``, ``.jpg`` or ``.jpeg`` for a picture. Of isosurfaces and meshes it may
            also end in ``.stl``, ``.ply``, ``.obj``, ``.glb`` or ``.3mf``.
        *arguments, **options
            Those of `isospline.render`, or those of `write`.

        Raises
        ------
        ValueError
            For another suffix.
        """
        known("save_picture_or_mesh")(self, path, *arguments, **options)
