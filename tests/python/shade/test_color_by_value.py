"""Colours by the values at the vertices of meshes, against interpolation by NumPy."""

import numpy as np
import pytest
from spheres import mesh_sphere, moved, sphere

import isospline
from isospline.base.values import part

SIZE = (64, 48)
CORNERS = np.array([(0.0, 0.0, 0.0), (4.0, 0.0, 1.0), (0.5, 3.0, 0.0)])
NUMBERS = np.array([-3.0, 7.0, 2.0])
GRAY = [(0, 0, 0), (1, 1, 1)]


def triangle(**options):
    return isospline.Mesh(CORNERS, [(0, 1, 2)], **{"values": NUMBERS, **options})


def shown(scene, **options):
    """Positions, linear colours and geometry ids of the pixels that a scene covers."""
    camera = isospline.OrthographicCamera((1.5, 1, 30), (1.5, 1, 0), height=10, up=(0, 1, 0))
    options = {
        "camera": camera,
        "size": SIZE,
        "layers": ("position", "albedo", "geometry_ids"),
        "light": "phong",
        **options,
    }
    image = isospline.render(scene, **options)
    is_hit = image.geometry_ids != isospline.INVALID_ID
    assert is_hit.sum() > 60
    return image.position[is_hit].astype(float), image.albedo[is_hit], image.geometry_ids[is_hit]


def between(points, corners=CORNERS, numbers=NUMBERS):
    """The values at points of a triangle, by the solution of three equations each."""
    equations = np.vstack([corners.T, np.ones(3)])
    weights, *_ = np.linalg.lstsq(equations, np.vstack([points.T, np.ones(len(points))]), rcond=None)
    return numbers @ weights


def mapped(values, rule, limits):
    fractions = (values - limits[0]) / (limits[1] - limits[0])
    places = np.linspace(0, 1, len(part(rule, "cmap")))
    return np.stack([np.interp(fractions, places, part) for part in np.asarray(part(rule, "cmap")).T], axis=-1)


def test_values_are_linear_over_a_triangle():
    points, colors, _ = shown(triangle())
    values = between(points)
    assert np.ptp(values) > 6
    np.testing.assert_allclose(colors, mapped(values, isospline.ColorByValue(), (-3, 7)), atol=2e-6)


@pytest.mark.parametrize("limits", [(0, 2), (5, -5)])
def test_limits_and_map_of_a_mesh_s_own_colour(limits):
    rule = isospline.ColorByValue("magma", limits=limits)
    points, colors, _ = shown(triangle(color=rule))
    np.testing.assert_allclose(colors, mapped(between(points), rule, limits), atol=5e-6)


def test_all_lights_show_the_values():
    lights = [
        isospline.Phong(),
        isospline.AmbientOcclusion(1),
        isospline.Outline(),
        isospline.PathTracer(),
    ]
    lights += [isospline.Studio(light_samples=1), isospline.Studio(fast=True), {0: isospline.Phong(color="red")}]
    expected = shown(triangle())[1]
    for light in lights[:-1]:
        np.testing.assert_array_equal(shown(triangle(), light=light)[1], expected)
    given = [shown(triangle(), light=lights[-1]), shown(triangle(), color="red"), shown(triangle(color="red"))]
    for _, colors, _ in [*given, shown(triangle(), light=isospline.Studio(materials={0: isospline.Material("red")}))]:
        np.testing.assert_array_equal(colors, np.broadcast_to((1, 0, 0), colors.shape))


def test_a_transform_moves_the_values_with_the_mesh():
    turn = np.array([(0.0, -1.2, 0, 3), (1.2, 0, 0, 0), (0, 0.3, 1.2, 0), (0, 0, 0, 1)])
    points, colors, _ = shown([(triangle(), turn)])
    values = between(points, CORNERS @ turn[:3, :3].T + turn[:3, 3])
    np.testing.assert_allclose(colors, mapped(values, isospline.ColorByValue(), (-3, 7)), atol=2e-6)


def test_meshes_with_the_same_name_of_values_share_their_limits():
    far = moved(-4, -3, 0)
    other = isospline.Mesh(CORNERS, [(0, 1, 2)], values=NUMBERS + 10)
    for name, limits in (("values", (-3, 17)), ("pressure in Pa", (7, 17))):
        named = isospline.Mesh(other, values=other.values, values_name=name)
        points, colors, ids = shown([triangle(), (named, far)])
        values = between(points[ids == 1], CORNERS + far[:3, 3]) + 10
        np.testing.assert_allclose(colors[ids == 1], mapped(values, isospline.ColorByValue(), limits), atol=5e-6)
    rule = isospline.ColorByValue(GRAY)
    red = isospline.Mesh(named, color="red")
    for light in (isospline.Phong(color=rule), isospline.Studio(material=isospline.Material(rule))):
        _, colors, ids = shown([triangle(color=rule), (red, far)], light=light)
        assert (colors[ids == 1] == (1, 0, 0)).all() and np.ptp(colors[ids == 0][:, 0]) > 0.5


def test_unknown_values_are_grey():
    grey = isospline.colors.srgb_to_linear(np.array([169 / 255] * 3))
    for values in ([1, np.nan, 2], [np.nan] * 3, [1, np.nan, 1]):
        _, colors, _ = shown(triangle(values=values))
        np.testing.assert_allclose(colors, np.broadcast_to(grey, colors.shape), atol=1e-3)
    _, colors, _ = shown(triangle(values=None), color=isospline.ColorByValue())
    np.testing.assert_allclose(colors, np.broadcast_to(grey, colors.shape), atol=1e-3)
    surface = isospline.render(sphere(), color=isospline.ColorByValue(), size=SIZE, layers=("albedo",), light="phong")
    np.testing.assert_allclose(surface.albedo[surface.color[..., 3] == 1].max(axis=0), grey, atol=1e-3)


def test_equal_values_have_the_middle_colour_and_infinite_ones_do_not_count():
    _, colors, _ = shown(triangle(values=[5, 5, 5], color=isospline.ColorByValue(GRAY)))
    np.testing.assert_allclose(colors, 0.5, atol=1e-6)
    _, plain, _ = shown(triangle(values=[5, 5, 5]))  # as contours of PyVista
    np.testing.assert_array_equal(plain, 1)
    fan = isospline.Mesh(
        [*CORNERS, (0, 0, 0)], [(0, 1, 2)], values=[*NUMBERS, np.inf], color=isospline.ColorByValue(GRAY)
    )
    points, colors, _ = shown(fan)
    np.testing.assert_allclose(colors[:, 0], (between(points) + 3) / 10, atol=1e-6)


def test_colours_of_vertices_stay_and_multiply_a_rule():
    _, plain, _ = shown(triangle(colors="red"))
    np.testing.assert_array_equal(plain, np.broadcast_to((1, 0, 0), plain.shape))
    _, colors, _ = shown(triangle(colors="red", color=isospline.ColorByValue(GRAY)))
    np.testing.assert_allclose(colors[:, 0], shown(triangle(color=isospline.ColorByValue(GRAY)))[1][:, 0], atol=1e-6)
    assert not colors[:, 1:].any()


def test_the_colour_bar_has_the_limits_and_the_name_of_the_values():
    from isospline.picture.annotations import color_rules
    from isospline.picture.lights import resolve

    mesh = triangle(values_name="temperature in K")
    for light in (None, isospline.Studio(), isospline.PathTracer(), isospline.Outline()):
        (rule,) = color_rules(resolve(isospline.Scene(mesh), light))
        assert (rule.limits, rule.label) == ((-3, 7), "temperature in K")
    for light in (isospline.Studio, isospline.PathTracer):
        by_value = light(material=isospline.Material(isospline.ColorByValue("magma")))
        bare = triangle(color=isospline.ColorByValue("magma"))
        (rule,) = color_rules(resolve(isospline.Scene(bare), by_value))
        assert rule.limits == (-3, 7)
    options = {"size": (160, 120), "background": "white"}
    assert isospline.render(mesh, annotate="colorbar", **options) != isospline.render(mesh, **options)
    with pytest.raises(ValueError, match="^annotate: expected a colour rule with a map"):
        isospline.render(mesh_sphere(1.0, 8), annotate="colorbar", **options)


def test_values_of_a_file_are_shown(tmp_path):
    pytest.importorskip("meshio")
    triangle(values_name="temperature").save(tmp_path / "part.ply")
    read = isospline.read_mesh(tmp_path / "part.ply")
    assert read.values_name == "temperature"
    np.testing.assert_allclose(shown(read)[1], shown(triangle())[1], atol=1e-6)


def test_words_of_pyvista_are_answered():
    with pytest.raises(TypeError, match="scalars.*did you mean values"):
        isospline.Mesh(CORNERS, [(0, 1, 2)], scalars=NUMBERS)
    with pytest.raises(TypeError, match="cmap.*did you mean color=ColorByValue"):
        isospline.Mesh(CORNERS, [(0, 1, 2)], values=NUMBERS, cmap="magma")
    with pytest.raises(TypeError, match="clim.*did you mean limits"):
        isospline.ColorByValue(clim=(0, 1))
    with pytest.raises(ValueError, match="^limits: expected two finite numbers that differ, got 1 and 1$"):
        isospline.ColorByValue(limits=(1, 1))
    assert repr(isospline.ColorByValue()) == "ColorByValue(cmap=array(256, 3), limits=None, label='')"
    assert repr(isospline.ColorByValue(limits=(0, 2))) == "ColorByValue(cmap=array(256, 3), limits=(0, 2), label='')"
