"""Volumes and meshes of other libraries, as methods of `Volume`, `Mesh` and `Isosurface`. Each has its own module.

A library is only imported when a method that needs it is called.
"""

from .._core import Isosurface, Mesh, Volume
from ..base.signatures import attach_methods, explained
from ..io.volume_data import VolumeData
from . import mesh_output, meshio, nibabel, printing, pyvista, sitk, trimesh, vtk, xarray
from .mesh_files import read_mesh
from .rays import RayMeshIntersector

__all__ = ["RayMeshIntersector", "read_mesh"]


attach_methods(
    Volume,
    classmethod,
    from_nibabel=nibabel.volume_from_nibabel,
    from_pyvista=pyvista.volume_from_pyvista,
    from_sitk=sitk.volume_from_sitk,
    from_vtk=vtk.volume_from_vtk,
    from_xarray=xarray.volume_from_xarray,
)
attach_methods(
    Mesh,
    classmethod,
    from_meshio=meshio.mesh_from_meshio,
    from_pyvista=pyvista.mesh_from_pyvista,
    from_trimesh=trimesh.mesh_from_trimesh,
    from_vtk=vtk.mesh_from_vtk,
)
attach_methods(
    Mesh,
    explained,
    to_meshio=mesh_output.to_meshio,
    to_pyvista=mesh_output.to_pyvista,
    to_trimesh=mesh_output.to_trimesh,
    write=mesh_output.write_mesh,
)
attach_methods(
    Isosurface,
    explained,
    to_print_mesh=printing.to_print_mesh,
    to_pyvista=mesh_output.surface_to_pyvista,
    to_trimesh=mesh_output.surface_to_trimesh,
    write=mesh_output.write_surface,
)
attach_methods(Volume, explained, to_pyvista=pyvista.volume_to_pyvista)
attach_methods(VolumeData, explained, to_pyvista=pyvista.volume_to_pyvista)
attach_methods(Mesh, explained, GetClassName=pyvista.class_name)
attach_methods(Isosurface, explained, GetClassName=pyvista.class_name)
