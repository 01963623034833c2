"""Values on the faces of cuts: their colours are those of the colour bar, in any light."""

import numpy as np
import pytest
import scipy.ndimage
from layered import render

import isospline

SIZE = (96, 72)
LIMITS = (-100.0, 300.0)
#: A view from the right and above: light from over the left shoulder grazes the cut.
CAMERA = isospline.PerspectiveCamera((40.0, -44.0, 52.0), (12.0, 12.0, 12.0), (0.0, 0.0, 1.0), 30.0)


@pytest.fixture(scope="module")
def samples():
    """Tissue with values about the middle of the limits, in air."""
    z, y, x = np.mgrid[:25, :25, :25].astype(float)
    body = np.sqrt((x - 12) ** 2 + (y - 12) ** 2 + (z - 12) ** 2) < 10.5
    tissue = 100 + 60 * np.sin(0.5 * x) * np.cos(0.4 * y + 0.3 * z)
    return scipy.ndimage.gaussian_filter(np.where(body, tissue, -100.0), 1.0)


@pytest.fixture(scope="module")
def scene(samples):
    cut = isospline.HalfSpace((12, 9.3, 12), (0, 1, 0))
    volume = isospline.Volume(samples)
    return isospline.Scene([isospline.Isosurface(volume, -20.0, clip=cut, capped=True)])


def inner(cap):
    """Pixels whose neighbours are on the cut as well: antialiasing mixes no others in."""
    return scipy.ndimage.binary_erosion(cap, np.ones((3, 3)))


def gray(samples, position):
    """The linear grey of the values at positions, by SciPy's spline."""
    values = scipy.ndimage.map_coordinates(samples, position[:, ::-1].T, order=2, mode="mirror")
    srgb = np.clip((values - LIMITS[0]) / (LIMITS[1] - LIMITS[0]), 0, 1)
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def looks(volume):
    options = {"cap_color": isospline.ColorByVolume(volume, "gray", limits=LIMITS)}
    phong = isospline.Phong(color="ivory", **options)
    material = isospline.Material("ivory", **options)
    lamp = isospline.EnvironmentLight(0.3)
    return {
        "phong": {"light": phong},
        "shadows": {"light": phong.replace(shadows=True)},
        "dark": {"light": phong.replace(lights=[], ambient=0.0)},
        "outline": {"light": isospline.Outline(2.0, **options)},
        "ambient occlusion": {"light": isospline.AmbientOcclusion(8, **options)},
        "studio": {"light": isospline.Studio(light_samples=1, material=material)},
        "fast studio": {"light": isospline.Studio(fast=True, material=material)},
        "path traced": {"light": isospline.PathTracer(isospline.Material("ivory", **options), lights=[lamp])},
        "metal": {"light": isospline.PathTracer(isospline.Material(1, metallic=1, **options), lights=[lamp])},
    }


@pytest.mark.parametrize("name", looks(isospline.Volume(np.zeros((4, 4, 4)))))
def test_values_on_a_cut_are_not_lit(scene, samples, name):
    volume = scene.object(0).volume
    options = {"size": SIZE, "background": "white", "samples": 1, **looks(volume)[name]}
    image = render(scene, CAMERA, **options)
    cap = image.primitive_ids == volume.cell_count
    assert inner(cap).sum() > 400 and (~cap & (image.geometry_ids == 0)).sum() > 100
    expected = gray(samples, image.position[cap].astype(float))
    assert 0.1 < np.median(expected) < 0.4
    error = np.abs(image.color[cap][:, :3] - expected[:, None])
    assert np.abs(image.albedo[cap][:, 0] - expected).max() < 4e-3
    # Positions are stored as float32, and the map has 256 colours.
    assert error[inner(cap)[cap]].max() < 4e-3


def test_a_colour_of_cuts_is_lit(scene):
    images = [
        render(scene, CAMERA, size=SIZE, samples=1, light=isospline.Phong(cap_color="gray", lights=lights))
        for lights in ([], None)
    ]
    cap = images[0].primitive_ids == scene.object(0).volume.cell_count
    assert (images[0].color[cap][:, 0] < images[1].color[cap][:, 0] - 0.01).all()


def test_the_rest_of_a_picture_does_not_change_with_values_on_the_cut(scene):
    """The values are drawn apart from the light of a studio, which must not light the surface or the ground twice.

    The means over blocks of pixels in a studio have no light of such a cut.
    """
    volume = scene.object(0).volume
    values = isospline.ColorByVolume(volume, "gray", limits=LIMITS)
    cut = isospline.Material("ivory", cap_color=values)
    for studio in (isospline.Studio(light_samples=1), isospline.Studio(fast=True)):
        options = {"size": SIZE, "background": "white", "samples": 1}
        plain = render(scene, CAMERA, light=studio.replace(material=isospline.Material("ivory")), **options)
        shown = render(scene, CAMERA, light=studio.replace(material=cut), **options)
        cap = plain.primitive_ids == volume.cell_count
        apart = ~(cap if studio.fast else scipy.ndimage.binary_dilation(cap, iterations=3))
        np.testing.assert_array_equal(shown.color[apart], plain.color[apart])
        assert np.abs(shown.color - plain.color)[~cap].max() < 0.15
        assert (shown.color[cap] != plain.color[cap]).any()


@pytest.mark.parametrize("light", [isospline.Studio(light_samples=1), isospline.Studio(fast=True)])
def test_values_on_one_cut_leave_the_albedo_of_another(scene, light):
    surface = scene.object(0)
    scene = isospline.Scene([surface, (surface, np.eye(4) + 24 * np.eye(4, k=3))])
    values = isospline.Material("ivory", cap_color=isospline.ColorByVolume(surface.volume, "gray", limits=LIMITS))
    light = light.replace(materials={0: values, 1: isospline.Material("ivory", cap_color=(0, 0, 1))})
    image = render(scene, isospline.camera_for(scene, view="front", size=SIZE), size=SIZE, samples=1, light=light)
    cap = image.primitive_ids == surface.volume.cell_count
    blue, gray = (image.albedo[cap & (image.geometry_ids == id)] for id in (1, 0))
    np.testing.assert_array_equal(blue, np.broadcast_to((0, 0, 1), blue.shape))
    assert len(blue) > 400 and len(gray) > 400 and np.ptp(gray[:, 0]) > 0.1


def test_colour_bars_show_the_values_of_cuts(scene):
    look = looks(scene.object(0).volume)["phong"]
    plain, marked = (
        isospline.render(scene, CAMERA, size=(320, 240), annotate=marks, **look) for marks in ((), ("colorbar",))
    )
    assert (plain.color != marked.color).any()
