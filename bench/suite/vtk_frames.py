"""VTK's pictures of a series of levels: of the mesh, and by its volume mappers, in an offscreen window.

All that does not depend on the level stays: the window, the camera, the pipeline, the volume's texture.
"""

import numpy as np

from . import polygons
from .clock import timed


def make(subject, affine, camera, size):
    """The methods that draw the subject: functions of the level that return the seconds of their stages and the pixels
    (N, 3)."""
    image, matrix = polygons.image_data(subject), polygons.user_matrix(affine)
    window = Window(camera, size)
    return {
        "mesh": mesh(window, image, matrix),
        "isosurface": volume(window, image, matrix, subject, "isosurface"),
        "fixed point": volume(window, image, matrix, subject, "fixed point"),
    }


def covered(pixels):
    """The fraction of a picture's pixels that are not black background."""
    return float((np.asarray(pixels) > 0).any(axis=1).mean())


class Window:
    """An offscreen window with one of isospline's cameras and a black background."""

    def __init__(self, camera, size):
        import vtkmodules.vtkRenderingOpenGL2  # noqa: F401
        import vtkmodules.vtkRenderingVolumeOpenGL2  # noqa: F401
        from vtkmodules.vtkRenderingCore import vtkRenderer, vtkRenderWindow, vtkWindowToImageFilter

        self.renderer, self.window = vtkRenderer(), vtkRenderWindow()
        self.window.SetOffScreenRendering(1)
        self.window.SetMultiSamples(0)
        self.window.SetSize(*size)
        self.window.AddRenderer(self.renderer)
        self.grab = vtkWindowToImageFilter()
        self.grab.SetInput(self.window)
        self.grab.ReadFrontBufferOff()
        self.grab.ShouldRerenderOff()
        view = self.renderer.GetActiveCamera()
        view.SetPosition(camera.eye)
        view.SetFocalPoint(camera.target)
        view.SetViewUp(camera.up)
        view.SetViewAngle(camera.field_of_view)

    def add(self, prop):
        prop.SetVisibility(False)
        self.renderer.AddViewProp(prop)

    def draw(self, prop):
        """Draw this prop alone, and read the pixels back."""
        from vtkmodules.util.numpy_support import vtk_to_numpy

        prop.SetVisibility(True)
        self.renderer.ResetCameraClippingRange()
        self.window.Render()
        prop.SetVisibility(False)
        self.grab.Modified()
        self.grab.Update()
        return vtk_to_numpy(self.grab.GetOutput().GetPointData().GetScalars())


def mesh(window, image, matrix):
    from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

    edges = polygons.flying_edges(image, 0.0, normals=True)
    mapper, actor = vtkPolyDataMapper(), vtkActor()
    mapper.SetInputConnection(edges.GetOutputPort())
    actor.SetMapper(mapper)
    actor.SetUserMatrix(matrix)
    actor.GetProperty().SetAmbient(0.05)
    window.add(actor)

    def frame(level):
        edges.SetValue(0, level)
        extract, _ = timed(edges.Update)
        render, pixels = timed(lambda: window.draw(actor))
        return {"extract": extract, "render": render}, pixels

    return frame


def volume(window, image, matrix, subject, way):
    from vtkmodules.vtkCommonDataModel import vtkPiecewiseFunction
    from vtkmodules.vtkRenderingCore import vtkColorTransferFunction, vtkVolume, vtkVolumeProperty
    from vtkmodules.vtkRenderingVolume import vtkFixedPointVolumeRayCastMapper, vtkGPUVolumeRayCastMapper

    lower, upper = (float(bound) for bound in (subject.data.min(), subject.data.max()))
    prop, opacity, color = vtkVolumeProperty(), vtkPiecewiseFunction(), vtkColorTransferFunction()
    opacity.AddPoint(upper, 1)
    color.AddRGBPoint(lower, 1, 1, 1)
    color.AddRGBPoint(upper, 1, 1, 1)
    prop.SetScalarOpacity(opacity)
    prop.SetColor(color)
    prop.SetInterpolationTypeToLinear()
    prop.ShadeOn()
    prop.SetAmbient(0.05)
    if way == "isosurface":
        mapper = vtkGPUVolumeRayCastMapper()
        mapper.SetBlendModeToIsoSurface()
    else:
        mapper = vtkFixedPointVolumeRayCastMapper()
    mapper.SetAutoAdjustSampleDistances(False)
    mapper.SetSampleDistance(0.5)  # of a voxel
    mapper.SetInputData(image)
    drawn = vtkVolume()
    drawn.SetMapper(mapper)
    drawn.SetUserMatrix(matrix)
    drawn.SetProperty(prop)
    window.add(drawn)

    def set_level(level):
        if way == "isosurface":
            prop.GetIsoSurfaceValues().SetValue(0, level)
            return
        opacity.RemoveAllPoints()
        opacity.AddPoint(lower, 0)
        opacity.AddPoint(level - 1e-3 * (upper - lower), 0)
        opacity.AddPoint(level, 1)
        opacity.AddPoint(upper, 1)

    def frame(level):
        set_level(level)
        render, pixels = timed(lambda: window.draw(drawn))
        return {"render": render}, pixels

    return frame
