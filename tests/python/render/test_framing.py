"""Framing: the visible objects are completely in the image and fill it, for every side, projection and aspect."""

import itertools

import numpy as np
import pytest
from projections import project
from spheres import mesh_sphere, moved, sphere

import isospline
from isospline import volumes
from isospline.picture.cameras import cameras_around
from isospline.picture.studio import upward_for
from isospline.suggest import presentation
from isospline.suggest.view import SuggestedView

SIZES = [(160, 120), (60, 240), (240, 60)]
VIEWS = ["three-quarter", "front", "top", (1, 2, -3)]


def speck():
    """A small ball in a corner of a large volume: the volume's box tells nothing about the ball."""
    z, y, x = np.mgrid[:40, :40, :40]
    return isospline.Isosurface(
        isospline.Volume((x - 31.0) ** 2 + (y - 30.0) ** 2 + (z - 8.0) ** 2), 25.0, inside="below"
    )


def diagonal():
    """A rod from one corner of its box to the opposite one; all other corners are empty."""
    z, y, x = np.mgrid[:48, :48, :48]
    distance = (x - y) ** 2 + (y - z) ** 2 + (z - x) ** 2
    ends = 9.0 * np.maximum(np.abs(x + y + z - 69.0) - 48, 0) ** 2
    return isospline.Isosurface(isospline.Volume((distance + ends).astype(np.float32)), 20.0, inside="below")


def scenes():
    half = isospline.Isosurface(
        sphere().volume,
        64.0,
        inside="below",
        clip=[isospline.HalfSpace((11.5, 11.5, 11.5), (1, 0.5, -0.3))],
        capped=True,
    )
    block = isospline.Volume(np.ones((12, 14, 16), np.float32))
    with pytest.warns(UserWarning):
        assert isospline.Isosurface(block, 0.5).shell.count == 0
    box = isospline.Isosurface(block, 0.5, clip=isospline.Box(*block.bounds), capped=True)
    oblique = isospline.Scene()
    turn = np.array([(0.6, -0.8, 0.1, 30), (0.8, 0.6, 0, -5), (0, 0.2, 1.5, 2), (0, 0, 0, 1)])
    oblique.add(sphere(), turn)
    oblique.add(mesh_sphere(3.0, 32), moved(60, 0, 9))
    hidden = isospline.Scene([sphere()])
    hidden.add(mesh_sphere(500.0, 16), visible=False)
    return {
        "ball": isospline.Scene(sphere()),
        "speck": isospline.Scene(speck()),
        "diagonal": isospline.Scene(diagonal()),
        "half": isospline.Scene(half),
        "all caps": isospline.Scene(box),
        "placed": oblique,
        "hidden": hidden,
        "mesh": isospline.Scene(mesh_sphere(3.0, 48)),
    }


SCENES = scenes()


def covered(scene, camera, size):
    """The first and the last covered column and row of a picture, as positions from -1 to 1 about its middle.

    A camera with three times the field takes the picture, so that it shows parts that would be cut off.
    """
    around = tuple(3 * side for side in size)
    wide = np.array(camera.rays(around))
    rays = np.array(camera.rays(size))
    corners = [rays[0, 0], rays[0, -1], rays[-1, 0]]
    step_x = (corners[1] - corners[0]) / (size[0] - 1)
    step_y = (corners[2] - corners[0]) / (size[1] - 1)
    x, y = np.arange(around[0]) - size[0], np.arange(around[1]) - size[1]
    wide = corners[0] + x[:, None] * step_x + y[:, None, None] * step_y
    hit = np.isfinite(scene.cast_rays(wide, coherent=True, outputs=("t_hit",)).t_hit)
    rows, columns = np.nonzero(hit.any(axis=1))[0], np.nonzero(hit.any(axis=0))[0]
    place = [columns[0], columns[-1] + 1, rows[0], rows[-1] + 1]
    return [(2 * (at - side) / side - 1) for at, side in zip(place, np.repeat(size, 2))]


@pytest.mark.sweep(64)
@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
@pytest.mark.parametrize("view", VIEWS, ids=str)
@pytest.mark.parametrize("name", SCENES)
def test_what_is_drawn_fills_the_image_and_is_never_cut_off(name, view, projection, size):
    scene, margin = SCENES[name], 0.08
    camera = isospline.camera_for(scene, view=view, projection=projection, size=size, margin=margin)
    left, right, top, bottom = covered(scene, camera, size)
    pixel = 2 / np.repeat(size, 2)
    assert left >= -1 + margin - pixel[0] and right <= 1 - margin + pixel[0]
    assert top >= -1 + margin - pixel[2] and bottom <= 1 - margin + pixel[2]
    # The extent is known to the size of a cell: for these volumes, some hundredths of the picture.
    cell = {"mesh": 0.0, "placed": 0.15, "speck": 0.25, "hidden": 0.16, "ball": 0.16, "half": 0.2}.get(name, 0.12)
    across = min(left + 1, 1 - right) - margin, min(top + 1, 1 - bottom) - margin
    assert min(max(left + 1, 1 - right), max(top + 1, 1 - bottom)) - margin <= cell + 2 * pixel.max(), across


@pytest.mark.sweep(6)
@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("name", ["diagonal", "half", "placed"])
def test_a_turntable_cuts_nothing_off(name, size, projection):
    scene = SCENES[name]
    cameras = isospline.turntable_cameras(scene, 7, projection=projection, size=size, margin=0.05)
    places = np.array([covered(scene, camera, size) for camera in cameras])
    pixel = 2 / np.repeat(size, 2)
    assert (places[:, [0, 2]] >= -0.95 - pixel[[0, 2]]).all() and (places[:, [1, 3]] <= 0.95 + pixel[[1, 3]]).all()
    assert np.abs(places).max() > 0.75
    for one, other in itertools.pairwise(cameras):
        np.testing.assert_allclose(one.target, other.target, atol=1e-9)
        if projection == "perspective":
            assert np.linalg.norm(one.eye - one.target) == pytest.approx(np.linalg.norm(other.eye - other.target))
        else:
            assert one.height == other.height


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
@pytest.mark.parametrize("space", [(0.3, 0.0, 0.0), (0.1, 0.25, 0.0), (0.2, 0.2, 0.3)])
def test_a_turntable_leaves_space_for_marks(space, projection):
    scene, size = SCENES["half"], (240, 60)
    cameras = cameras_around(space, scene, 5, projection=projection, size=size, margin=0.05, field_of_view=40.0)
    places = np.array([covered(scene, camera, size) for camera in cameras])
    free = np.array([-1 + 2 * space[0] + 0.05, 1 - 2 * space[1] - 0.05])
    pixel = 2 / np.repeat(size, 2)
    assert (places[:, 0] >= free[0] - pixel[0]).all() and (places[:, 1] <= free[1] + pixel[0]).all()
    assert (places[:, 2] >= -0.95 - pixel[2]).all() and (places[:, 3] <= 0.95 - 2 * space[2] + pixel[2]).all()
    # The axis of the turn is in the middle of the free part: what is on it stays there.
    axis = [project(camera.world_to_ndc(size), scene.bounds.mean(axis=0)[None], size)[0, :2] for camera in cameras]
    middle = np.array([1 + space[0] - space[1], 1 - space[2]]) / 2
    np.testing.assert_allclose(axis, np.broadcast_to(size * middle, (5, 2)), atol=1e-6)


def test_the_extent_of_a_ball():
    directions = np.random.default_rng(1).normal(size=(50, 3))
    lengths = np.linalg.norm(directions, axis=1)
    extent = isospline.Scene(sphere(8.0)).extent(directions)
    middle = directions @ np.full(3, 11.5)
    cell = np.abs(directions).sum(axis=1)
    assert (extent[:, 1] >= middle + 8 * lengths).all() and (extent[:, 1] <= middle + 8 * lengths + 2 * cell).all()
    assert (extent[:, 0] <= middle - 8 * lengths).all() and (extent[:, 0] >= middle - 8 * lengths - 2 * cell).all()


def test_components_that_are_left_out_take_no_room():
    """A bar and, in a corner of the volume, a block that reaches its border: the largest one alone is framed."""
    data = np.zeros((20, 22, 24), np.float32)
    data[8:12, 8:12, 3:18] = 100
    data[17:, 18:, 20:] = 100
    volume = isospline.Volume(data, degree=1)
    border = isospline.Box(*volume.bounds)
    both, bar = (isospline.Isosurface(volume, 50, clip=border, capped=True, largest=count) for count in (None, 1))
    axes = np.eye(3)
    np.testing.assert_allclose(isospline.Scene(both).extent(axes)[:, 1], [23, 21, 19])
    extent = isospline.Scene(bar).extent(axes)
    assert (extent[:, 1] <= [18, 12, 12]).all() and (extent[:, 0] >= [2, 7, 7]).all()
    camera = isospline.camera_for(bar, view="front", size=(96, 64))
    left, right, _, _ = covered(isospline.Scene(bar), camera, (96, 64))
    assert right - left > 1.7


def test_the_extent_of_a_mesh_is_that_of_its_faces():
    vertices = [(0, 0, 0), (1, 0, 0), (0, 2, 0), (50, 50, 50)]
    scene = isospline.Scene(isospline.Mesh(vertices, [(0, 1, 2)]))
    np.testing.assert_allclose(scene.extent([(1, 0, 0), (1, 1, 1)]), [(0, 1), (0, 2)])
    assert scene.extent(np.zeros((2, 4, 3))).shape == (2, 4, 2)


def test_the_extent_of_nothing_and_of_bad_directions():
    assert isospline.Scene().extent([(0, 0, 1)]).tolist() == [[np.inf, -np.inf]]
    for bad in ([(0, 0)], [(0, np.nan, 1)]):
        with pytest.raises(ValueError, match="^directions: expected "):
            isospline.Scene(sphere()).extent(bad)
    with pytest.raises(ValueError, match="^scene: expected visible surfaces"):
        isospline.camera_for(isospline.Scene())


def test_the_middle_of_what_is_seen_is_looked_at():
    camera = isospline.camera_for(speck(), view="front")
    np.testing.assert_allclose(camera.target, (31, 30, 8), atol=1.0)


def test_surfaces_and_meshes_are_rendered_by_themselves():
    field = volumes.torus()
    surface = isospline.Isosurface(field.volume(32), field.level)
    for item in (surface, mesh_sphere(1.0, 16)):
        assert isospline.render(item, size=(24, 18), light="phong") == isospline.render(
            isospline.Scene([item]), size=(24, 18), light="phong"
        )


@pytest.mark.parametrize("scale", [1e-9, 1e-3, 10.0])
def test_a_transform_to_another_unit_turns_no_suggested_view(scale, monkeypatch):
    suggested = SuggestedView((-0.45, 1.0, -0.3), (0.0, 0.0, -1.0), "it stands on its head")
    monkeypatch.setattr(presentation, "_view", lambda *_: suggested)
    field = isospline.volumes.torus()
    surface = isospline.Isosurface(field.volume(16), field.level)
    placed = surface, np.diag([scale, scale, scale, 1])
    expected, found = (isospline.camera_for(isospline.Scene([each])) for each in (surface, placed))
    assert found.up.tolist() == expected.up.tolist() == [0, 0, -1]
    np.testing.assert_allclose(found.world_to_camera[:3, :3], expected.world_to_camera[:3, :3], atol=1e-9)
    assert isospline.camera_for(isospline.Scene([surface, placed])).up.tolist() == [0, 0, -1]
    # The suggested top leans by 60 degrees to the camera's upward direction, which is z.
    leaning = np.diag([scale, scale, scale, 1])
    leaning[1:3, 1:3] = scale * np.array([(-0.5, np.sqrt(0.75)), (-np.sqrt(0.75), -0.5)])
    camera = isospline.PerspectiveCamera((0, -10, 0), (0, 0, 0))
    assert upward_for(isospline.Scene([(surface, leaning)]), camera) == (0, 0, 1)
