"""Meshes of other libraries."""

from __future__ import annotations

from os import PathLike
from typing import TYPE_CHECKING, Any

from .. import _core
from ..base.signatures import methods_of
from ..interop.mesh_output import to_meshio, to_pyvista, to_trimesh, write_mesh
from ..interop.meshio import mesh_from_meshio
from ..interop.pyvista import class_name
from ..interop.trimesh import mesh_from_trimesh
from ..interop.vtk import mesh_from_vtk

if TYPE_CHECKING:
    from typing_extensions import Self


@methods_of("Mesh")
class MeshConversions(_core.Mesh):
    """The part of `Mesh` about other libraries and files."""

    __slots__ = ()

    @classmethod
    def from_meshio(cls, mesh: object, **options: Any) -> Self:
        """Convert the faces of a meshio mesh or, if it has none, the surface of its solid cells.

        Quadrilaterals, polygons and curved faces are cut into triangles. Lines and single points are left out. Normals
        and colours of points are kept, with the names of `Mesh.to_meshio`, or of the properties of PLY. The first other
        array with one number a point is kept as values, with its name.

        Parameters
        ----------
        mesh : meshio.Mesh
            With two or three coordinates per point; with two, z is 0.
        **options
            Options of `Mesh`.

        Returns
        -------
        Mesh

        Raises
        ------
        TypeError
            If `mesh` is something else.
        ValueError
            If it has neither faces nor solid cells, or a vertex that is not finite.
        ImportError
            If meshio or PyVista is not installed: ``pip install isospline[interop]``.

        Examples
        --------
        >>> import meshio, isospline
        >>> square = meshio.Mesh([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [("quad", [(0, 1, 2, 3)])])
        >>> isospline.Mesh.from_meshio(square).faces.shape
        (2, 3)
        """
        return mesh_from_meshio(cls, mesh, **options)

    @classmethod
    def from_pyvista(cls, mesh: object, **options: Any) -> Self:
        """Convert a surface of PyVista.

        Polygons and strips are cut into triangles, in the order of the cells; triangles are not changed. Lines and
        single points are left out. Normals, colours and values of points are kept, as in `Mesh.from_vtk`.

        Parameters
        ----------
        mesh : pyvista.PolyData, UnstructuredGrid or StructuredGrid
            For grids, their faces are used or, if they have none, the surface of their solid cells.
        **options
            Options of `Mesh`.

        Returns
        -------
        Mesh

        Raises
        ------
        TypeError, ValueError, ImportError
            As in `Mesh.from_vtk`.

        Examples
        --------
        >>> import pyvista, isospline
        >>> isospline.Mesh.from_pyvista(pyvista.Cube()).faces.shape
        (12, 3)
        """
        return mesh_from_vtk(cls, mesh, **options)

    @classmethod
    def from_trimesh(cls, mesh: object, **options: Any) -> Self:
        """Convert a trimesh mesh, without changes of vertices and faces.

        Vertex normals that were given to the mesh are kept, and those equal to what trimesh computes are not: pass
        ``normals=mesh.vertex_normals`` for them. Colours of vertices are kept. So are, with their name, the first of
        the ``vertex_attributes``, or of the further properties of a PLY file, with one number a vertex: the values. For
        a scene, attributes are kept that all its meshes have.

        Parameters
        ----------
        mesh : trimesh.Trimesh or trimesh.Scene
            For a scene, all meshes, placed by its graph, one after the other.
        **options
            Options of `Mesh`.

        Returns
        -------
        Mesh

        Raises
        ------
        TypeError
            If `mesh` is something else, such as a point cloud.
        ValueError
            If it has no faces, or a vertex that is not finite.
        ImportError
            If trimesh is not installed: ``pip install isospline[interop]``.

        Examples
        --------
        >>> import trimesh, isospline
        >>> isospline.Mesh.from_trimesh(trimesh.creation.box()).faces.shape
        (12, 3)
        """
        return mesh_from_trimesh(cls, mesh, **options)

    @classmethod
    def from_vtk(cls, mesh: object, **options: Any) -> Self:
        """Convert a surface of VTK.

        Polygons and strips are cut into triangles, in the order of the cells; triangles are not changed. Lines and
        single points are left out. Normals of points are kept, and their colours: the active scalars if they are bytes,
        or an array named colors, RGB or RGBA, of three or four numbers a point, sRGB in bytes or from 0 to 1. One array
        with one number a point is kept as values, with its name: the active scalars or, if they are something else, the
        first such array.

        Parameters
        ----------
        mesh : vtkPolyData, vtkUnstructuredGrid or vtkStructuredGrid
            For grids, their faces are used or, if they have none, the surface of their solid cells.
        **options
            Options of `Mesh`.

        Returns
        -------
        Mesh

        Raises
        ------
        TypeError
            If `mesh` is something else.
        ValueError
            If it has no faces, or a vertex that is not finite.
        ImportError
            If VTK is not installed: ``pip install isospline[io]``.

        Examples
        --------
        >>> import isospline
        >>> from vtkmodules.vtkFiltersSources import vtkCubeSource
        >>> cube = vtkCubeSource()
        >>> _ = cube.Update()
        >>> isospline.Mesh.from_vtk(cube.GetOutput()).faces.shape
        (12, 3)
        """
        return mesh_from_vtk(cls, mesh, **options)

    def to_meshio(self) -> Any:
        """Convert to a mesh of meshio.

        Returns
        -------
        meshio.Mesh
            One block of triangles, with the point data "normals" and "colors", sRGB from 0 to 1, and the values, by
            their name, if the mesh has them.

        Raises
        ------
        ImportError
            If meshio is not installed: ``pip install isospline[interop]``.

        Examples
        --------
        >>> import isospline
        >>> isospline.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]).to_meshio().cells_dict["triangle"].tolist()
        [[0, 1, 2]]
        """
        return to_meshio(self)

    def to_pyvista(self) -> Any:
        """Convert to a surface of PyVista, and so of VTK.

        Returns
        -------
        pyvista.PolyData
            With the point data "Normals", active, and "colors", sRGB from 0 to 255, if the mesh has them. Its values,
            by their name, are the active scalars.

        Raises
        ------
        ImportError
            If PyVista is not installed: ``pip install isospline[interop]``.

        Examples
        --------
        >>> import isospline
        >>> isospline.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]).to_pyvista().n_cells
        1
        """
        return to_pyvista(self)

    def to_trimesh(self) -> Any:
        """Convert to a mesh of trimesh, with the same vertices and faces.

        Returns
        -------
        trimesh.Trimesh
            With vertex normals and colours if the mesh has them, and its values among the ``vertex_attributes``. It is
            not processed: no vertices are merged.

        Raises
        ------
        ImportError
            If trimesh is not installed: ``pip install isospline[interop]``.

        Examples
        --------
        >>> import isospline
        >>> mesh = isospline.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]).to_trimesh()
        >>> print(mesh.area)
        0.5
        """
        return to_trimesh(self)

    def write(self, path: str | PathLike[str], *, unit: str | None = None) -> None:
        """Write the mesh to a file, completely or not at all.

        ========  =====================================================================  =========
        suffix    contents                                                               by
        ========  =====================================================================  =========
        ``.stl``  binary; the corners of each face in float32, nothing else              isospline
        ``.ply``  binary; vertices, faces, normals and values in float64, 8-bit colours  meshio
        ``.obj``  text; vertices, faces, normals and colours in float64                  isospline
        ``.glb``  binary glTF; vertices, faces, normals and linear colours in float32    trimesh
        ``.3mf``  compressed, for printers; vertices and faces, and the unit             trimesh
        ========  =====================================================================  =========

        Normals are written if the mesh has them. STL and glTF hold vertices in float32. Far from the origin, for
        instance in UTM coordinates, float32 cannot hold the detail of a mesh. Vertices are then written relative to an
        offset near the mesh. In glTF, the offset is the translation of the mesh's node, in float64, which readers add.
        In STL, only the 80 bytes of the header have room for it: a warning names the offset, `read_mesh` adds it, and
        other programs show the mesh near the origin.

        Parameters
        ----------
        path : str or path-like
        unit : str, optional
            The unit of the vertices for 3MF: "um", "mm", "cm", "m", "inch" or "ft". By default millimetres, as programs
            take numbers without a unit. The other formats hold none.

        Warns
        -----
        UserWarning
            If the mesh has values or colours that the format does not have. If STL needs an offset, and if no offset
            helps: if float32 moves corners of more than 1% of the faces by more than a quarter of their shortest edges,
            as in a mesh of small parts that are far apart.

        Raises
        ------
        ValueError
            For another suffix, if the mesh has no faces, if float32 cannot hold a coordinate of STL or glTF, and for
            another unit.
        OSError
            If the file cannot be written.
        ImportError
            If the library is not installed: ``pip install isospline[interop]``.

        Examples
        --------
        >>> import tempfile, isospline
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     isospline.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]).write(f"{folder}/triangle.stl")
        ...     isospline.read_mesh(f"{folder}/triangle.stl")
        Mesh(3 vertices, 1 faces)
        """
        write_mesh(self, path, unit=unit)

    def GetClassName(self) -> str:
        """The name by which `pyvista.wrap` finds the conversion, so that ``plotter.add_mesh`` accepts the object."""
        return class_name(self)
