"""Frames of VTK: of the mesh, and of its volume mappers, in an offscreen window."""

import os
import statistics

from . import polygons
from .clock import timed


def measure(subject, affine, camera, settings):
    """Seconds and covered part of the image of each way to draw the subject."""
    polygons.use_threads(os.cpu_count())
    image, matrix = polygons.image_data(subject), polygons.user_matrix(affine)
    window = Window(camera, settings.size)
    window.draw([])  # opened, and its shaders' compiler warm
    return {
        "mesh": repeat(lambda: mesh_frame(window, image, matrix, subject.level), settings.repetitions),
        "isosurface": repeat(lambda: volume_frame(window, image, matrix, subject, "isosurface"), 1),
        "fixed point": repeat(lambda: volume_frame(window, image, matrix, subject, "fixed point"), 1),
    }


def repeat(frame, repetitions):
    """Medians of the stages' seconds."""
    runs = [frame() for _ in range(repetitions)]
    return {
        "seconds": {name: statistics.median(seconds[name] for seconds, _ in runs) for name in runs[0][0]},
        "covered": runs[0][1],
    }


class Window:
    """An offscreen window with a camera of isospline's; its background is black."""

    def __init__(self, camera, size):
        import vtkmodules.vtkRenderingOpenGL2
        import vtkmodules.vtkRenderingVolumeOpenGL2  # noqa: F401
        from vtkmodules.vtkRenderingCore import vtkRenderer, vtkRenderWindow

        self.renderer, self.window = vtkRenderer(), vtkRenderWindow()
        self.window.SetOffScreenRendering(1)
        self.window.SetMultiSamples(0)
        self.window.SetSize(*size)
        self.window.AddRenderer(self.renderer)
        view = self.renderer.GetActiveCamera()
        view.SetPosition(camera.eye)
        view.SetFocalPoint(camera.target)
        view.SetViewUp(camera.up)
        view.SetViewAngle(camera.field_of_view)

    def draw(self, props):
        """The part of the image that the props cover, drawn and read back."""
        from vtkmodules.util.numpy_support import vtk_to_numpy
        from vtkmodules.vtkRenderingCore import vtkWindowToImageFilter

        for prop in props:
            self.renderer.AddViewProp(prop)
        self.renderer.ResetCameraClippingRange()
        self.window.Render()
        grab = vtkWindowToImageFilter()
        grab.SetInput(self.window)
        grab.ReadFrontBufferOff()
        grab.Update()
        pixels = vtk_to_numpy(grab.GetOutput().GetPointData().GetScalars())
        for prop in props:
            self.renderer.RemoveViewProp(prop)
            prop.ReleaseGraphicsResources(self.window)
        return float((pixels > 0).any(axis=1).mean())


def mesh_frame(window, image, matrix, level):
    from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

    edges = polygons.flying_edges(image, level, normals=True)
    extract, _ = timed(edges.Update)
    mapper, actor = vtkPolyDataMapper(), vtkActor()
    mapper.SetInputConnection(edges.GetOutputPort())
    actor.SetMapper(mapper)
    actor.SetUserMatrix(matrix)
    actor.GetProperty().SetAmbient(0.05)
    render, covered = timed(lambda: window.draw([actor]))
    return {"extract": extract, "render": render}, covered


def volume_frame(window, image, matrix, subject, way):
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
        prop.GetIsoSurfaceValues().SetValue(0, subject.level)
    else:
        mapper = vtkFixedPointVolumeRayCastMapper()
        opacity.AddPoint(lower, 0)
        opacity.AddPoint(subject.level - 1e-3 * (upper - lower), 0)
        opacity.AddPoint(subject.level, 1)
    mapper.SetAutoAdjustSampleDistances(False)
    mapper.SetSampleDistance(0.5)  # of a voxel
    mapper.SetInputData(image)
    volume = vtkVolume()
    volume.SetMapper(mapper)
    volume.SetUserMatrix(matrix)
    volume.SetProperty(prop)
    seconds, covered = timed(lambda: window.draw([volume]))
    return {"render": seconds}, covered
