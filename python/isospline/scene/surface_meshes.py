"""Meshes of isosurfaces."""

from __future__ import annotations

from os import PathLike
from typing import TYPE_CHECKING, Any, Literal, overload

from .. import _core
from ..base.signatures import methods_of
from ..interop.mesh_output import mesh_of, write_surface
from ..interop.mesh_parts import parts_of
from ..interop.pyvista import class_name
from .printing import to_print_mesh

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ..base.results import MeshReport, PrintReport
    from ..base.types import Progress
    from .mesh import Mesh


@methods_of("Isosurface")
class SurfaceMeshes(_core.Isosurface):
    """The part of `Isosurface` about meshes."""

    __slots__ = ()

    @overload
    def to_mesh(
        self,
        tolerance: float | None = None,
        *,
        faces: int | None = None,
        return_distance: Literal[False] = False,
        return_report: Literal[False] = False,
        progress: Progress = None,
    ) -> Mesh: ...

    @overload
    def to_mesh(
        self,
        tolerance: float,
        *,
        faces: int | None = None,
        return_distance: Literal[True],
        return_report: Literal[False] = False,
        progress: Progress = None,
    ) -> tuple[Mesh, float]: ...

    @overload
    def to_mesh(
        self,
        tolerance: float,
        *,
        faces: int | None = None,
        return_distance: Literal[False] = False,
        return_report: Literal[True],
        progress: Progress = None,
    ) -> tuple[Mesh, MeshReport]: ...

    @overload
    def to_mesh(
        self,
        tolerance: float | None = None,
        *,
        faces: int,
        return_distance: Literal[True],
        return_report: Literal[False] = False,
        progress: Progress = None,
    ) -> tuple[Mesh, float]: ...

    @overload
    def to_mesh(
        self,
        tolerance: float | None = None,
        *,
        faces: int,
        return_distance: Literal[False] = False,
        return_report: Literal[True],
        progress: Progress = None,
    ) -> tuple[Mesh, MeshReport]: ...

    def to_mesh(
        self,
        tolerance: float | None = None,
        *,
        faces: int | None = None,
        return_distance: bool = False,
        return_report: bool = False,
        progress: Progress = None,
    ) -> Any:
        r"""A triangle mesh of the surface, with its clip and caps.

        .. math:: |f(\mathbf{v}) - f_0| \approx 0 \text{ for every vertex } \mathbf{v} \text{ that is not on a cap,}

        without a tolerance. With one, vertices are on both sides of the surface, so that the mesh encloses the same
        volume where the tolerance allows it; those on caps and at borders are not moved.

        The mesh is a manifold. An edge has two faces, or one where the surface ends: at the border of the volume if it
        is not closed, at cuts by `mask`, and at a `clip` that is not capped. If the surface is closed, the mesh is
        watertight for all samples. Faces are counter-clockwise as seen from outside. Normals are exact, those of the
        surface where a vertex was before it was moved. On caps they are those of the planes; at vertices that a cap
        shares with the surface, those of the surface.

        Parameters
        ----------
        tolerance : float, optional
            The largest distance between the surface and the mesh, in both directions, in world units. Edges are
            collapsed as long as it holds, and the result is proven. At least 2^-14 of a voxel's shortest edge: the
            finest lattice follows sharper bends no better. Without a tolerance, the vertices are where the surface
            crosses the edges of cells.
        faces : int, optional
            In place of a tolerance, the largest number of triangles. The smallest tolerance for it is searched, down to
            1/32 of a voxel's shortest edge. At least 85% of the triangles are used, unless this smallest tolerance
            needs fewer, or a tolerance that is 5% smaller needs too many. Takes a few times as long as the mesh with
            that tolerance.
        return_distance : bool
            Whether to return the proven distance as well. Needs a tolerance or a number of faces.
        return_report : bool
            Whether to return all that is proven as well. Needs a tolerance or a number of faces.
        progress : callable, optional
            Called with the finished fraction; cancels if it returns a false value other than None.

        Returns
        -------
        Mesh
            In the volume's world space; without faces if there is no surface.
        float
            With `return_distance`: a proven bound, in world units. No point of the mesh is farther from the surface and
            its caps, and none of their points, but for parts that are left out, is farther from the mesh.
        MeshReport
            With `return_report`:

            - ``distance``: as above.
            - ``left_out``: parts of the surface that may be farther than the tolerance from the mesh, in boxes. All
              numbers are float64 in world units. ``positions``, (N, 3): centres of the boxes. ``sizes``, (N, 3): sizes
              of the boxes along the volume's axes. ``distances``, (N,): bounds on the distances of the parts from the
              mesh.
            - ``self_intersections``: the number of pairs of faces that meet elsewhere than at common vertices and
              edges, by exact arithmetic.
            - ``missing_volume``: the volume that the surface encloses and the mesh does not, less that which the mesh
              alone encloses, in world units cubed. An estimate, from the height of the surface at points of the faces;
              too small where the tolerance is not small against the radius of curvature. A mesh that is open at the
              border of the volume, at a clip or at a mask counts as closed by flat lids there.

        Raises
        ------
        ValueError
            For a tolerance that is not positive or too small, a tolerance and `faces` together, `return_distance` or
            `return_report` without either, and both of them together. For fewer `faces` than any mesh of the surface
            has; the error names the fewest that were found, and the distance of that mesh.

        Warns
        -----
        UserWarning
            If the distance exceeds the tolerance, for example where sheets of the surface meet in a point; if parts of
            the surface are left out; if faces cross.

        Notes
        -----
        Without a tolerance, the topology follows from the signs at the corners of cells: parts of the surface that
        cross no edge of the lattice an odd number of times are missed. With a tolerance, cells are subdivided where
        Bernstein coefficients do not prove that mesh and surface are near to each other. Only parts between the nodes
        of the finest lattice, 1/32 of a cell apart, can be left out, and then they are listed.

        References
        ----------
        .. [1] W. Lorensen, H. Cline, "Marching cubes: a high resolution 3D surface construction algorithm", SIGGRAPH
           1987.
        .. [2] M. Garland, P. Heckbert, "Surface simplification using quadric error metrics", SIGGRAPH 1997.
        .. [3] P. Lindstrom, G. Turk, "Fast and memory efficient polygonal simplification", IEEE Visualization 1998.

        Examples
        --------
        >>> import isospline
        >>> field = isospline.volumes.sphere(0.7)
        >>> volume = field.volume(32)
        >>> ball = isospline.Isosurface(volume, field.level)
        >>> mesh = ball.to_mesh()
        >>> coarse, distance = ball.to_mesh(0.02, return_distance=True)
        >>> len(coarse.faces) < len(mesh.faces), distance <= 0.02
        (True, True)
        >>> small, distance = ball.to_mesh(faces=500, return_distance=True)
        >>> 425 <= len(small.faces) <= 500, distance < 0.02
        (True, True)
        """
        return super().to_mesh(tolerance, faces, return_distance, return_report, progress)

    def mesh_parts(self, *, cells: int = 2**22, progress: Progress = None) -> Iterator[Mesh]:
        """The mesh without a tolerance, one part after the other, in little memory.

        Each part is that of some layers of the volume along its last axis, z. For volumes of stores, in which the whole
        mesh may be larger than memory. Together, the parts are the mesh of `to_mesh`: vertices that two of them share
        have the same coordinates, bit for bit. Only edges shorter than 1/1000 of a voxel between two parts stay, which
        `to_mesh` collapses. Later changes of the surface do not change the parts.

        Parameters
        ----------
        cells : int
            About how many cells the layers of a part have. A part has at least 8 layers. The memory that a part needs
            grows with the number of its faces.
        progress : callable, optional
            Called with the finished fraction of all parts; cancels if it returns a false value other than None.

        Yields
        ------
        Mesh
            In the volume's world space, with faces and exact normals.

        Raises
        ------
        ValueError
            For fewer than one cell.

        Examples
        --------
        >>> import isospline
        >>> field = isospline.volumes.sphere(0.7)
        >>> ball = isospline.Isosurface(field.volume(32), field.level)
        >>> parts = list(ball.mesh_parts())
        >>> sum(len(part.faces) for part in parts) == len(ball.to_mesh().faces)
        True
        """
        return parts_of(self, cells, progress)

    def to_print_mesh(
        self, tolerance: float | None = None, *, faces: int | None = None, progress: Progress = None
    ) -> tuple[Mesh, PrintReport]:
        """Make a mesh for a 3D printer: the largest piece of the solid, closed, without cavities, and checked.

        The solid is closed at the border of the volume, whether or not the surface is ``closed``. Only its largest
        piece is kept, the connected component with the largest volume, as ``largest=1`` keeps it; of a clipped surface,
        the largest piece that the clip leaves. Cavities, which are closed surfaces inside the solid, are filled: no
        printer can empty them. The mesh is then proven to be watertight.

        Parameters
        ----------
        tolerance : float, optional
            The largest distance between surface and mesh, world units; see `to_mesh`.
        faces : int, optional
            In place of a tolerance, the largest number of triangles; see `to_mesh`. It includes those of the cavities
            that are filled and, of a clipped surface, those of pieces that are not kept.
        progress : callable, optional
            Called with the finished fraction; cancels if it returns a false value other than None.

        Returns
        -------
        Mesh
            In the volume's world space, with normals.
        PrintReport
            What was done. ``str(report)`` is one sentence.

        Raises
        ------
        ValueError
            If there is no surface; for a `clip` that is not capped; for a ``largest`` other than 1 or None; if a `mask`
            cuts the surface, where it stays open. Also as in `to_mesh`.

        Warns
        -----
        UserWarning
            If the mesh touches itself, where samples equal the level. Also as in `to_mesh`.

        Examples
        --------
        >>> import numpy as np
        >>> import isospline
        >>> z, y, x = np.mgrid[0:24, 0:24, 0:40]
        >>> radius = np.sqrt((x - 12) ** 2 + (y - 12) ** 2 + (z - 12) ** 2)
        >>> hollow = np.minimum(9 - radius, radius - 4)
        >>> speck = 3 - np.sqrt((x - 32) ** 2 + (y - 12) ** 2 + (z - 12) ** 2)
        >>> surface = isospline.Isosurface(isospline.Volume(np.maximum(hollow, speck), unit="mm"), 0)
        >>> mesh, report = surface.to_print_mesh(tolerance=0.2)
        >>> report.pieces, report.cavities, report.closed_at_border
        (2, 1, False)
        >>> print(str(report).replace(f"{report.faces:,}", "N"))
        kept 1 of 2 pieces, filled 1 cavity, N faces, watertight, no faces cross
        """
        return to_print_mesh(self, tolerance, faces=faces, progress=progress)

    def to_pyvista(self, tolerance: float | None = None, *, faces: int | None = None, for_print: bool = False) -> Any:
        """Convert its mesh to PyVista: ``surface.to_mesh(tolerance, faces=faces).to_pyvista()``.

        Parameters
        ----------
        tolerance : float, optional
        faces : int, optional
            As in `to_mesh`.
        for_print : bool
            Whether it is the mesh of `to_print_mesh`, one closed piece without cavities.

        Returns
        -------
        pyvista.PolyData
        """
        return mesh_of(self, tolerance, faces, for_print)[0].to_pyvista()

    def to_trimesh(self, tolerance: float | None = None, *, faces: int | None = None, for_print: bool = False) -> Any:
        """Convert its mesh to trimesh: ``surface.to_mesh(tolerance, faces=faces).to_trimesh()``.

        Parameters
        ----------
        tolerance : float, optional
        faces : int, optional
            As in `to_mesh`.
        for_print : bool
            Whether it is the mesh of `to_print_mesh`, one closed piece without cavities.

        Returns
        -------
        trimesh.Trimesh
        """
        return mesh_of(self, tolerance, faces, for_print)[0].to_trimesh()

    @overload
    def write(
        self,
        path: str | PathLike[str],
        tolerance: float | None = None,
        *,
        faces: int | None = None,
        for_print: Literal[False] = False,
        progress: Progress = None,
    ) -> None: ...

    @overload
    def write(
        self,
        path: str | PathLike[str],
        tolerance: float | None = None,
        *,
        faces: int | None = None,
        for_print: Literal[True],
        progress: Progress = None,
    ) -> PrintReport: ...

    def write(
        self,
        path: str | PathLike[str],
        tolerance: float | None = None,
        *,
        faces: int | None = None,
        for_print: bool = False,
        progress: Progress = None,
    ) -> PrintReport | None:
        """Write the mesh of the surface to a file: ``surface.to_mesh(tolerance, faces=faces).write(path)``.

        The STL file of a surface in a store is written in parts, those of `mesh_parts`, without a tolerance or a number
        of faces: the mesh may be larger than memory.

        Parameters
        ----------
        path : str or path-like
            Ends in ``.stl``, ``.ply``, ``.obj``, ``.glb`` or ``.3mf``; see `Mesh.write`. 3MF has the unit of the
            volume.
        tolerance : float, optional
            The largest distance between surface and mesh, world units; see `to_mesh`.
        faces : int, optional
            In place of a tolerance, the largest number of triangles; see `to_mesh`.
        for_print : bool
            Whether to write the mesh of `to_print_mesh`, one closed piece without cavities.
        progress : callable, optional
            Called with the finished fraction; cancels if it returns a false value other than None.

        Returns
        -------
        PrintReport or None
            With `for_print`, what was done; ``print(report)`` prints one sentence.

        Raises
        ------
        ValueError, OSError, ImportError
            As in `to_mesh`, `to_print_mesh` and `Mesh.write`.

        Warns
        -----
        UserWarning
            If 3MF does not have the unit of the volume, such as "nm". Also as in `to_mesh` and `Mesh.write`.

        Examples
        --------
        >>> import tempfile, isospline
        >>> field = isospline.volumes.sphere(0.7)
        >>> ball = isospline.Isosurface(field.volume(32), field.level)
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     ball.write(f"{folder}/ball.ply", tolerance=0.05)
        """
        return write_surface(self, path, tolerance, faces=faces, for_print=for_print, progress=progress)

    def GetClassName(self) -> str:
        """The name by which `pyvista.wrap` finds the conversion, so that ``plotter.add_mesh`` accepts the object."""
        return class_name(self)
