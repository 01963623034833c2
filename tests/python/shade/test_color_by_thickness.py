"""Colours by the thickness of solids, against closed forms."""

import pickle
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from spheres import CENTER, mesh_sphere, moved, sphere

import isospline

SIZE = (32, 24)
GRAY = [(0, 0, 0), (1, 1, 1)]
AXES = np.array([1.0, 1.5, 2.5])  # x, y, z


def ellipsoid(**options):
    """The surface |(x - centre) / AXES| = 4, exactly, as the sphere of spheres.py."""
    x, y, z = (((np.arange(24) - 11.5) ** 2 - 0.25) / axis**2 for axis in AXES)
    volume = isospline.Volume(z[:, None, None] + y[:, None] + x, filter="none")
    return isospline.Isosurface(volume, 16.0, inside="below", **options)


def chord(points):
    """The length of the inward normal in the ellipsoid, at its points."""
    offset = points - CENTER
    normals = offset / AXES**2
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    return 2 * (offset * normals / AXES**2).sum(axis=-1) / (normals**2 / AXES**2).sum(axis=-1)


def plate(middle, half):
    """The solid |z - middle| < half, which the borders of the volume cut."""
    z = (np.arange(24) - middle) ** 2 - 0.25
    volume = isospline.Volume(np.tile(z[:, None, None], (1, 24, 24)), filter="none")
    return isospline.Isosurface(volume, half**2, inside="below")


def shown(scene, rule, **options):
    """Positions and colours of the pixels that a scene covers."""
    options = {"size": SIZE, "light": "phong", "background": "transparent", "samples": 1, **options}
    image = isospline.render(scene, color=rule, layers=("position", "albedo"), **options)
    is_hit = image.color[..., 3] == 1
    assert is_hit.sum() > 40
    return image.position[is_hit].astype(float), image.albedo[is_hit][:, 0].astype(float)


def test_an_ellipsoid():
    points, colors = shown(ellipsoid(), isospline.ColorByThickness(GRAY, limits=(0, 25)))
    expected = chord(points)
    assert np.ptp(expected) > 3
    np.testing.assert_allclose(25 * colors, expected, rtol=1e-5)


def test_a_plate():
    _, colors = shown(plate(11.75, 2.75), isospline.ColorByThickness(GRAY, limits=(5, 6)))
    np.testing.assert_allclose(5 + colors, 5.5, atol=1e-5)


def test_the_largest_ball_in_a_sphere():
    rule = isospline.ColorByThickness(GRAY, limits=(15, 17), method="max_sphere", ripple=0)
    _, colors = shown(sphere(), rule, size=(12, 9))
    np.testing.assert_allclose(15 + 2 * colors, 16, atol=2e-3)  # twice the precision of a radius


def test_a_transform_scales_the_thickness():
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    place = moved(3, -2, 5)
    place[:3, :3] = 1.7 * turn
    points, colors = shown([(ellipsoid(), place)], isospline.ColorByThickness(GRAY, limits=(0, 50)))
    back = (points - place[:3, 3]) @ np.linalg.inv(place[:3, :3]).T
    np.testing.assert_allclose(50 * colors, 1.7 * chord(back), rtol=2e-5)
    sheared = place @ np.diag([1, 1, 2, 1])
    with pytest.raises(ValueError, match="^transform: expected a rotation, a translation and a uniform scale, for the"):
        isospline.render([(ellipsoid(), sheared)], color=isospline.ColorByThickness(), size=SIZE, light="phong")


def test_lights_and_threads_give_the_same_colours():
    surface, rule = ellipsoid(), isospline.ColorByThickness(GRAY, limits=(0, 25))
    camera = isospline.camera_for(surface, size=SIZE)
    expected = shown(surface, rule, camera=camera)[1]
    lights = [isospline.AmbientOcclusion(1), isospline.Outline(), isospline.Studio(light_samples=1)]
    lights += [isospline.Studio(fast=True), isospline.PathTracer(max_bounces=1), {}]
    for light in lights[:-1]:
        np.testing.assert_array_equal(shown(surface, rule, light=light, camera=camera)[1], expected)
    of_light = [isospline.Phong(color=rule), isospline.Studio(material=isospline.Material(rule)), None]
    for light in of_light:
        own = surface if light else ellipsoid(color=rule)
        np.testing.assert_array_equal(shown(own, None, light=light, camera=camera)[1], expected)
    with ThreadPoolExecutor(4) as pool:
        for _, each in pool.map(lambda _: shown(surface, rule, camera=camera), range(8)):
            np.testing.assert_array_equal(each, expected)


def test_each_surface_has_its_own_solid_and_a_mesh_one_that_is_given():
    scene = isospline.Scene([sphere(4.0), (sphere(6.0), moved(15, 0, 0))])
    rule = isospline.ColorByThickness(GRAY, limits=(0, 24))
    points, colors = shown(scene, rule)
    radii = np.where(np.linalg.norm(points - CENTER, axis=1) < 4.1, 4, 6)
    assert len(set(radii)) == 2
    np.testing.assert_allclose(24 * colors, 2 * radii, rtol=1e-5)
    mesh = mesh_sphere(8.0, 32)
    with pytest.raises(ValueError, match=r"^color: expected ColorByThickness\(surface=\.\.\.\) for a mesh, got one"):
        isospline.render(mesh, color=rule, size=SIZE, light="phong")
    at_origin = rule.replace(surface=sphere(7.0), transform=moved(*-CENTER))
    np.testing.assert_allclose(24 * shown(mesh, at_origin)[1], 14, rtol=1e-5)


def test_default_limits_hold_most_of_the_area_of_all_surfaces_with_the_rule():
    from isospline.picture.annotations import color_rules
    from isospline.picture.lights import resolve

    surface, rule = ellipsoid(), isospline.ColorByThickness()
    for light in (isospline.Phong(), isospline.Studio(), isospline.PathTracer()):
        (shown_rule,) = color_rules(resolve(isospline.Scene(surface), light, color=rule))
        many = chord(surface.sample_points(20000, seed=9)["points"])
        lower, upper = shown_rule.limits
        assert lower == 0 and 0.96 < (many < upper).mean() < 0.995
    red = isospline.Isosurface(sphere().volume, 81.0, inside="below", color="red")
    two = [sphere(4.0), (sphere(6.0), moved(15, 0, 0)), red]
    light = isospline.Phong(color=rule)
    (bar,) = color_rules(resolve(isospline.Scene(two), light))
    np.testing.assert_allclose(bar.limits, (0, 12), rtol=1e-5)
    (bar,) = color_rules(resolve(isospline.Scene([(sphere(6.0), 2 * np.eye(4) - np.diag([0, 0, 0, 1]))]), light))
    np.testing.assert_allclose(bar.limits, (0, 24), rtol=1e-5)
    with pytest.warns(UserWarning, match="there is no surface"):
        empty = isospline.Scene([isospline.Isosurface(sphere().volume, -50.0)])
    assert color_rules(resolve(empty, light))[0].limits == (0, 1)


def test_an_open_solid_has_the_last_colour():
    half = plate(15, 10)  # z from 5 to beyond the border of the volume
    camera = isospline.OrthographicCamera((11.5, 11.5, -40), (11.5, 11.5, 0), height=20, up=(0, 1, 0))
    assert np.isinf(half.thickness((11.5, 11.5, 5), method="ray"))
    _, colors = shown(half, isospline.ColorByThickness(GRAY, limits=(0, 9)), camera=camera)
    assert (colors == 1).all()


def test_the_title_of_the_bar_has_the_unit():
    from isospline.picture.annotations import _title

    rule = isospline.ColorByThickness()
    assert (_title(rule, "mm"), _title(rule, ""), _title(rule.replace(label="wall"), "mm")) == (
        "thickness (mm)",
        "thickness",
        "wall",
    )


def test_the_solid_is_that_of_the_moment_and_comes_back():
    surface = sphere(8.0)
    rule = isospline.ColorByThickness(GRAY, limits=(0, 20), surface=surface)
    surface.level = 36.0
    np.testing.assert_allclose(20 * shown(sphere(8.0), rule)[1], 16, rtol=1e-5)
    np.testing.assert_allclose(20 * shown(surface, rule.replace(surface=None))[1], 12, rtol=1e-5)
    rule.surface.level = 1.0  # of a copy
    again = pickle.loads(pickle.dumps(rule))
    assert again == rule == rule.replace(label="") != rule.replace(method="max_sphere")
    assert (again.limits, again.method, again.ripple, again.surface.level) == ((0, 20), "ray", None, 64.0)
    assert repr(rule).startswith(
        "ColorByThickness(cmap=array(2, 3), limits=(0, 20), method='ray', ripple=None, surface="
    )
    assert "surface=None, transform=array(4, 4)" in repr(isospline.ColorByThickness())


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"limits": (1, 1)}, "limits: expected two finite numbers that differ, got 1 and 1"),
        ({"cmap": "no"}, "cmap: expected"),
        ({"method": "ball"}, "method: expected"),
        ({"ripple": -1}, "ripple: expected"),
        ({"transform": np.diag([1, 1, 2, 1])}, "transform: expected a rotation, a translation and a uniform scale"),
        ({"transform": np.zeros((4, 4))}, "transform: expected a rotation, a translation and a uniform scale"),
    ],
)
def test_bad_thicknesses_are_refused(options, message):
    with pytest.raises(ValueError, match=f"^{message}"):
        isospline.ColorByThickness(**options)
