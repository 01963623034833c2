"""Colours by the distance from other objects, against closed forms."""

import pickle
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from spheres import mesh_sphere, sphere

import isospline
from isospline.base.values import part

SIZE = (48, 36)
CENTER = 11.5
BOX = isospline.Mesh(
    [(x, y, z) for x in (4.0, 19.0) for y in (4.0, 19.0) for z in (4.0, 19.0)],
    [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4)]
    + [(1, 5, 7), (1, 7, 3)],
)


def distance_from_box(points):
    """Signed distances from a cube of edge 15 about the centre."""
    outside = np.abs(points - CENTER) - 7.5
    return np.linalg.norm(np.maximum(outside, 0), axis=-1) + np.minimum(outside.max(axis=-1), 0)


def expected(rule, distances):
    places = np.linspace(*rule.limits, len(part(rule, "cmap")))
    return np.stack([np.interp(distances, places, part) for part in np.asarray(part(rule, "cmap")).T], axis=-1)


def colors(surface, rule, **options):
    """Positions and colours of the pixels that a surface covers."""
    options = {"light": "phong", "background": "transparent", "samples": 1, **options}
    image = isospline.render(surface, color=rule, size=SIZE, layers=("position", "albedo"), **options)
    is_hit = image.color[..., 3] == 1
    assert is_hit.sum() > 200
    return image.position[is_hit].astype(float), image.albedo[is_hit]


@pytest.mark.parametrize("signed", [True, False])
def test_the_distance_of_a_surface_from_a_mesh(signed):
    rule = isospline.ColorByDistance(BOX, [(0, 0, 0), (1, 1, 1)], limits=(-2, 2), signed=signed)
    points, shown = colors(sphere(9.0), rule)
    distances = distance_from_box(points)
    np.testing.assert_allclose(shown, expected(rule, distances if signed else np.abs(distances)), atol=2e-6)
    assert distances.min() < -0.3 and distances.max() > 0.3


def test_the_distance_of_a_mesh_from_a_surface():
    rule = isospline.ColorByDistance(sphere(8.0), limits=(-4, 4))
    points, shown = colors(BOX, rule)
    np.testing.assert_allclose(shown, expected(rule, np.linalg.norm(points - CENTER, axis=-1) - 8), atol=2e-5)


def test_the_distance_from_a_scene_and_from_points():
    scene = isospline.Scene([(mesh_sphere(3.0, 16), np.eye(4)), sphere(3.0)])
    for other in (scene, np.random.default_rng(2).normal(CENTER, 5, (500, 3))):
        rule = isospline.ColorByDistance(other, "viridis", limits=(0, 4), signed=False)
        points, shown = colors(sphere(8.0), rule)
        if other is scene:
            distances = scene.closest_points(points).distances
        else:
            distances = np.linalg.norm(points[:, None] - other, axis=-1).min(axis=1)
        np.testing.assert_allclose(shown, expected(rule, distances), atol=1e-5)


def test_lights_and_threads_give_the_same_colours():
    rule = isospline.ColorByDistance(sphere(8.0), limits=(-4, 4))
    lights = [isospline.Phong(), isospline.AmbientOcclusion(1), isospline.Studio(light_samples=1)]
    lights.append(isospline.PathTracer(max_bounces=1))
    shown = [colors(BOX, rule, light=light)[1] for light in lights]
    for each in shown[1:]:
        np.testing.assert_array_equal(each, shown[0])
    with ThreadPoolExecutor(4) as pool:
        for _, each in pool.map(lambda _: colors(BOX, rule), range(8)):
            np.testing.assert_array_equal(each, shown[0])


def test_the_objects_are_those_of_the_moment_and_come_back():
    surface = sphere(8.0)
    rule = isospline.ColorByDistance(surface, limits=(-4, 4), label="deviation in mm")
    before = colors(BOX, rule)[1]
    without_limits = rule.replace(limits=None)
    fitted = colors(BOX, without_limits)[1]
    surface.level = 36.0
    rule.other.object(0).level = 36.0
    again = pickle.loads(pickle.dumps(rule))
    for each in (rule, rule.replace(label="deviation"), again):
        np.testing.assert_array_equal(colors(BOX, each)[1], before)
    np.testing.assert_array_equal(colors(BOX, without_limits)[1], fitted)
    assert rule.other.ids == [0] and rule.other.object(0).level != 36
    assert rule == rule.replace(label="deviation in mm") != rule.replace(limits=(0, 1))
    assert (again.signed, again.limits, again.label) == (True, (-4, 4), "deviation in mm")
    shown = "other=Scene(1 objects), cmap=array(256, 3), limits=(-4, 4), signed=True, label='deviation in mm'"
    assert repr(rule) == f"ColorByDistance({shown})"


@pytest.mark.parametrize(
    ("other", "options", "message"),
    [
        (np.zeros((4, 3)), {}, "signed: expected False for distances from points, which have no inside, got True"),
        (np.zeros((4, 2)), {}, "other: expected an Isosurface, a Mesh, a Scene or points of shape .N, 3., got shape"),
        (np.zeros((0, 3)), {"signed": False}, "other: expected objects with points, got some without"),
        (isospline.Scene(), {}, "other: expected objects with points, got some without"),
        (BOX, {"limits": (1, 1)}, "limits: expected two finite numbers that differ, got 1 and 1"),
        (BOX, {"cmap": "no"}, "cmap: expected"),
    ],
)
def test_bad_distances_are_refused(other, options, message):
    with pytest.raises(ValueError, match=f"^{message}"):
        isospline.ColorByDistance(other, **{"limits": (-1, 1), **options})


@pytest.mark.parametrize("other", [None, "part.stl", sphere().volume], ids=lambda other: type(other).__name__)
def test_other_types_are_refused(other):
    with pytest.raises(
        TypeError, match="^other: expected an Isosurface, a Mesh, a Scene or points of shape .N, 3., got"
    ):
        isospline.ColorByDistance(other, limits=(-1, 1))
