"""Subjects as data of VTK, and their marching-cubes meshes."""

import numpy as np

import isospline


def image_data(subject):
    """A vtkImageData of the samples in index space."""
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonDataModel import vtkImageData

    image = vtkImageData()
    image.SetDimensions(*reversed(subject.data.shape))
    image.GetPointData().SetScalars(numpy_to_vtk(np.ascontiguousarray(subject.data).ravel()))
    return image


def user_matrix(affine):
    """A vtkMatrix4x4 that maps a prop from index space to the world."""
    from vtkmodules.vtkCommonMath import vtkMatrix4x4

    matrix = vtkMatrix4x4()
    matrix.DeepCopy(np.asarray(affine, dtype=float).ravel().tolist())
    return matrix


def use_threads(count):
    """Let VTK's filters use several threads; they are sequential by default."""
    from vtkmodules.vtkCommonCore import vtkSMPTools

    tools = vtkSMPTools()
    if tools.GetBackend() == "Sequential":
        tools.SetBackend("STDThread")
    tools.Initialize(count)


def flying_edges(image, level, normals=False):
    """A vtkFlyingEdges3D that has not run yet."""
    from vtkmodules.vtkFiltersCore import vtkFlyingEdges3D

    edges = vtkFlyingEdges3D()
    edges.SetInputData(image)
    edges.SetValue(0, level)
    edges.SetComputeNormals(normals)
    edges.ComputeScalarsOff()
    return edges


def triangles_of(polygons):
    """(V, 3) vertices and (F, 3) faces of vtkPolyData of nothing but triangles."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    vertices = vtk_to_numpy(polygons.GetPoints().GetData()).astype(np.float64)
    return vertices, vtk_to_numpy(polygons.GetPolys().GetConnectivityArray()).reshape(-1, 3)


def marching_cubes(subject, affine):
    """The triangles of the subject's surface in world space, without those that have no area: vertices and faces."""
    edges = flying_edges(image_data(subject), subject.level)
    edges.Update()
    vertices, faces = triangles_of(edges.GetOutput())
    corners = vertices[faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    return vertices @ affine[:3, :3].T + affine[:3, 3], faces[area > 1e-12].astype(np.uint32)


def mesh_scene(subject, affine):
    """A scene of nothing but the marching-cubes mesh; its number of triangles, and the bytes of the mesh."""
    mesh = isospline.Mesh(*marching_cubes(subject, affine))
    return isospline.Scene([mesh]), len(mesh.faces), len(mesh.vertices) * 12 + len(mesh.faces) * 12
