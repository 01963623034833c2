"""Twelve tasks as a new user would write them, who knows NumPy, PyVista, trimesh, Open3D, VTK and Mitsuba alone.

Each task is one test. What works at the first guess is called as it is. A wrong guess, at most one in a task, stands in
`answered`: its error has to hold the right call, which the next line then uses.
"""

from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest
from guesses import answered

import isospline as iso

FEW = dict(size=(48, 36), samples=1)


@pytest.fixture
def ct(tmp_path):
    """A NIfTI file of a CT whose values fall by 50 a sample from 700 in the middle: 8 samples away, they are 300."""
    nibabel = pytest.importorskip("nibabel")
    z, y, x = np.mgrid[0:32, 0:32, 0:32]
    data = (700 - 50 * np.sqrt((x - 15.5) ** 2 + (y - 15.5) ** 2 + (z - 15.5) ** 2)).astype(np.int16)
    nibabel.save(nibabel.Nifti1Image(data.T, np.diag([-0.8, -0.8, 1.5, 1])), tmp_path / "ct.nii.gz")
    return tmp_path / "ct.nii.gz"


@pytest.fixture
def volume():
    return iso.volumes.torus().volume(24)


@pytest.fixture
def surface(volume):
    return iso.Isosurface(volume, 0.0)


def test_ct_to_printed_stl(ct, tmp_path):
    data = iso.read_volume(ct)
    assert data.shape == (32, 32, 32) and data.dtype == np.int16 and data.range[1] > 600
    assert np.asarray(data).max() == data.range[1] and np.asarray(data, dtype=float).dtype == float
    bone = iso.Isosurface(data, level=300)
    with answered("Isosurface(volume, level, largest=1)"):
        bone.keep_largest()
    bone = iso.Isosurface(data, level=300, largest=1)
    mesh = bone.to_mesh()
    mesh.save(tmp_path / "bone.stl")
    mesh.export(str(tmp_path / "bone.ply"))
    bone.save(tmp_path / "direct.stl")
    bone.save(tmp_path / "bone.png", size=(48, 36))
    trimesh = pytest.importorskip("trimesh")
    printed = trimesh.load_mesh(tmp_path / "bone.stl")
    assert printed.is_watertight and bone.to_trimesh().is_watertight
    assert printed.volume == pytest.approx(4 / 3 * np.pi * 8**3 * 0.8 * 0.8 * 1.5, rel=0.02)


def test_porosity_over_ten_levels(capsys):
    field = iso.volumes.gyroid()
    surface = iso.Isosurface(field.volume(32), level=0)
    box = np.prod(np.diff(surface.volume.bounds, axis=0))
    porosities = []
    for level in np.linspace(-1, 1, 10):
        surface.level = level
        porosity = 1 - surface.enclosed_volume() / box
        print(f"{level:.2f}: {porosity}, {porosity:.1%}")
        porosities.append(porosity)
    assert " ± " in capsys.readouterr().out
    assert np.all(np.diff(np.array(porosities, dtype=float)) > 0)
    assert porosities[0] < 0.5 < porosities[-1] and 0 < porosities[0].error < 1e-3
    with answered("enclosed_volume()"):
        surface.porosity()
    pytest.importorskip("pandas")
    assert len(surface.components().to_frame()) == len(surface.components(measured=True).areas)


def test_deviation_from_a_cad_mesh_with_a_colour_bar(surface, tmp_path):
    trimesh = pytest.importorskip("trimesh")
    cad = iso.Mesh(trimesh.creation.torus(0.6, 0.26))
    deviation = iso.surface_distance(surface, cad, samples=500)
    assert deviation.mean.value == pytest.approx(0.01, abs=0.004) and deviation["maximum"] == deviation.maximum
    assert set(deviation.keys()) >= {"mean", "rms", "maximum", "points", "distances"}
    scene = iso.Scene(cad)
    nearest = scene.closest_points(deviation.points)
    np.testing.assert_allclose(nearest.distances, deviation.distances)
    z, y, x = np.mgrid[-1:1:24j, -1:1:24j, -1:1:24j]
    distances = scene.signed_distance(np.stack([x, y, z], axis=-1))
    with answered("color=ColorByVolume("):
        iso.render(surface, scalars=distances, cmap="coolwarm", light="phong")
    at = iso.Volume(distances, spacing=(2 / 23,) * 3, origin=(-1, -1, -1))
    colored = iso.ColorByVolume(at, "coolwarm", limits=(-0.02, 0.02))
    plain = iso.render(surface, color=colored, size=(320, 240), light="phong")
    image = iso.render(surface, color=colored, size=(320, 240), annotate=True, light="phong")
    assert (np.asarray(image) != np.asarray(plain)).any(axis=-1).mean() > 0.01
    iso.ColorByVolume(distances)
    image.save(tmp_path / "deviation.png")


def test_opencv_camera_to_exr(surface, tmp_path):
    intrinsics = np.array([[60.0, 0, 24], [0, 60.0, 18], [0, 0, 1]])
    rotation, translation = np.diag([1.0, -1, -1]), np.array([0, 0, 3.0])
    with answered("ProjectionPlaneCamera.from_opencv("):
        iso.Camera(intrinsics, rotation, translation)
    camera = iso.ProjectionPlaneCamera.from_opencv(intrinsics, rotation, translation, size=(48, 36))
    image = iso.render(surface, camera, size=(48, 36), layers=["depth"], light="phong")
    image.save(tmp_path / "picture.exr")
    OpenEXR = pytest.importorskip("OpenEXR")
    with OpenEXR.File(str(tmp_path / "picture.exr")) as file:
        assert "Z" in file.channels()
    assert image.depth[18, 35] == pytest.approx(3 - 0.25, abs=0.05) and image.depth.shape == (36, 48)


def test_path_traced_scene_with_hdr_sky(surface, tmp_path):
    cv2 = pytest.importorskip("cv2")
    pytest.importorskip("OpenImageIO")
    sky = np.full((16, 32, 3), 0.5, np.float32)
    assert cv2.imwrite(str(tmp_path / "sky.hdr"), sky)
    light = iso.EnvironmentLight(str(tmp_path / "sky.hdr"))
    np.testing.assert_allclose(iso.EnvironmentLight(sky).image, light.image, rtol=0.01)
    gold = iso.Material("gold", metallic=1)
    with answered("light=PathTracer("):
        iso.render(surface, integrator="path", spp=4, light="phong")
    tracer = iso.PathTracer(materials={surface: gold}, lights=[light])
    image = iso.render(surface, light=tracer, samples=4, size=(48, 36))
    own = iso.render(iso.Isosurface(surface.volume, 0.0, material=gold), light=iso.PathTracer(lights=[light]), **FEW)
    assert image.color[..., 0].max() > image.color[..., 2].max() and own.color[..., 0].max() > own.color[..., 2].max()


class TensorWithGradient:
    """What PyTorch's tensors do where PyTorch is not installed."""

    requires_grad = True

    def __init__(self, array):
        self._array = array

    def __array__(self, dtype=None, copy=None):
        raise RuntimeError("Can't call numpy() on Tensor that requires grad. Use tensor.detach().numpy() instead.")

    def detach(self):
        return self._array


def test_torch_rays(surface):
    try:
        import torch
    except ImportError:
        make = TensorWithGradient
    else:

        def make(array):
            return torch.tensor(array, requires_grad=True)

    origins, directions = np.array([(-3, 0.6, 0), (-3, 3.0, 0)], np.float32), np.array([(1, 0, 0)] * 2, np.float32)
    with answered("cast_rays("):
        iso.Scene(surface).intersect(origins, directions)
    with pytest.warns(UserWarning, match="a tensor that requires a gradient is read without it; isospline.derivatives"):
        hits = iso.Scene(surface).cast_rays(make(origins), make(directions))
    assert hits.t_hit.dtype == np.float32 and np.isfinite(hits.t_hit).tolist() == [True, False]
    with pytest.warns(UserWarning, match="requires a gradient"):
        joined = iso.Scene(surface).cast_rays(make(np.hstack([origins, directions])))
    np.testing.assert_array_equal(joined["t_hit"], hits["t_hit"])
    with pytest.warns(UserWarning, match="requires a gradient"):
        assert surface.signed_distance(make(origins)).shape == (2,)


def test_notebook_slider(surface):
    """What ``ipywidgets.interact(picture, level=(-0.1, 0.05))`` calls."""

    def picture(level):
        surface.level = level
        return iso.render(surface, color="ivory", opacity=0.5, **FEW)

    assert picture(-0.05)._repr_png_() != picture(0.0)._repr_png_()
    # viewer/test_viewer_notebook.py has the pictures of the others.
    drawn = surface.to_mesh(), iso.VolumeData(np.eye(8)[None] * np.eye(8)[:, None])
    assert all(each._repr_png_().startswith(b"\x89PNG") for each in drawn)
    for shown in (surface, surface.volume, iso.Scene(surface), *drawn):
        assert callable(shown._repr_png_) and callable(shown.show) and callable(shown.save)
    with answered("view(surface)"):
        iso.show(surface)


def test_turntable(surface, tmp_path):
    cameras = iso.turntable_cameras(surface, 3, size=(48, 36))
    images = [iso.render(surface, camera, size=(48, 36), light="phong") for camera in cameras]
    pytest.importorskip("imageio_ffmpeg")
    with answered("write_video(path, images)"):
        iso.animate(images, tmp_path / "turn.mp4")
    iso.write_video(tmp_path / "turn.mp4", images)
    assert (tmp_path / "turn.mp4").stat().st_size > 500


def test_two_transparent_surfaces_with_legend():
    volume = iso.volumes.blobs(6).volume(24)
    skin = iso.Isosurface(volume, 0.2, color="peachpuff", opacity=0.4, name="skin")
    bone = iso.Isosurface(volume, 0.6, color="ivory", name="bone")
    image = iso.render([skin, bone], size=(48, 36), light="phong")
    by_hand = {0: iso.Phong(color="peachpuff", opacity=0.4), 1: iso.Phong(color="ivory")}
    assert image == iso.render(iso.Scene([skin, bone]), size=(48, 36), light=by_hand)
    assert (skin.name, skin.opacity, bone.opacity) == ("skin", 0.4, 1.0)
    one = iso.render(skin, color="ivory", opacity=0.5, size=(48, 36), light="phong")
    assert one == iso.render(skin, light={skin: iso.Phong(color="ivory", opacity=0.5)}, size=(48, 36))
    large = [
        iso.render([skin, bone], size=(240, 180), legend=legend, background="white", light="phong")
        for legend in (False, True)
    ]
    assert (np.asarray(large[0]) != np.asarray(large[1])).any()


def test_time_series(tmp_path):
    series = np.stack([iso.volumes.sphere(radius).values(16) for radius in (0.4, 0.5, 0.6)])
    with answered("series[0]"):
        iso.Volume(series)
    surfaces = [iso.Isosurface(iso.Volume(samples), 0.0) for samples in series]
    volumes = [surface.enclosed_volume() for surface in surfaces]
    assert volumes[0] < volumes[1] < volumes[2]
    images = [iso.render(samples, level=0.0, **FEW) for samples in series]
    assert len({image._repr_png_() for image in images}) == 3


def test_pyvista_plotter(surface):
    pyvista = pytest.importorskip("pyvista")
    plotter = pyvista.Plotter(off_screen=True, window_size=(64, 48))
    plotter.add_mesh(surface.to_mesh(), color="ivory")
    plotter.add_mesh(surface)
    assert plotter.screenshot(return_img=True).std() > 1
    plotter.close()
    grid = surface.volume.to_pyvista()
    assert grid.contour([0.0]).n_points > 100 and surface.to_pyvista().n_cells == len(surface.to_mesh().faces)
    assert iso.VolumeData(np.zeros((4, 5, 6))).to_pyvista().dimensions == (6, 5, 4)
    with answered("Isosurface(volume, level)"):
        surface.volume.contour([0.0])


def area_at(surface, level):
    surface.level = level
    return surface.area()


def test_workers(surface):
    levels = [-0.1, -0.05, 0.0]
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as workers:
        areas = list(workers.map(area_at, [surface] * 3, levels))
    assert areas == [surface.with_level(level).area() for level in levels]
    with answered("set_thread_count("):
        iso.set_num_threads(2)
