"""Derivatives of pictures: outlines beside closed forms, and whole pictures beside finite differences."""

import itertools

import numpy as np
import pytest

import isospline
from isospline import volumes
from isospline.derivatives import picture_vjp
from isospline.derivatives.film import Film, Samples, jittered
from isospline.derivatives.outlines import Outlines
from isospline.derivatives.shades import PhongShade, Seen

SIZE = (36, 30)
CAMERA = isospline.PerspectiveCamera((4, 1.13, 1.5), (0, 0, 0), field_of_view=36)
PHONG = isospline.Phong(
    color=(0.9, 0.6, 0.3),
    ambient=0.1,
    specular_exponent=4,
    lights=[
        isospline.DirectionalLight((-1, 0.3, -0.5)),
        isospline.PositionalLight((3, 3, 1), intensity=(0.5, 0.4, 0.3)),
    ],
)
#: A change of a placement: a motion and a turn.
CHANGE = np.array([[0, -0.4, 0.2, 0.3], [0.4, 0, -0.3, 0.5], [-0.2, 0.3, 0, -0.7], [0, 0, 0, 0]])
PLANE_CAMERA = isospline.ProjectionPlaneCamera((4, 0, 0), corner=(0, -1, 1), right=(0.2, 2, 0), down=(0, 0, -1.8))


def turn(first, second):
    """Positive if the second of two vectors in a picture is counter-clockwise from the first."""
    return first[0] * second[1] - first[1] * second[0]


def convex_outline(points):
    """The area inside of the outline of a convex solid, given its corners in a picture: Andrew's monotone chain."""
    ordered = sorted(map(tuple, points))

    def chain(points):
        kept = []
        for point in points:
            while len(kept) > 1 and turn(np.subtract(kept[-1], kept[-2]), np.subtract(point, kept[-1])) <= 0:
                kept.pop()
            kept.append(point)
        return kept[:-1]

    x, y = np.array(chain(ordered) + chain(ordered[::-1])).T
    return 0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))


def placed(item, transform=None):
    return isospline.Scene([(item, np.eye(4) if transform is None else transform)])


@pytest.mark.parametrize("camera", [CAMERA, isospline.OrthographicCamera((3, 1, 2), (0, 0, 0), height=2), PLANE_CAMERA])
@pytest.mark.parametrize("size", [SIZE, (1, 3)])
def test_the_rays_of_a_film_are_those_of_its_camera(camera, size):
    film = Film.of_camera(camera, size)
    y, x = np.mgrid[0 : size[1], 0 : size[0]]
    positions = np.stack([x, y], axis=-1) + 0.5
    assert np.allclose(film.rays(positions), camera.rays(size), atol=1e-12)
    back, t = film.project(film.rays(positions).reshape(-1, 6) @ np.vstack([np.eye(3), 2.5 * np.eye(3)]))
    assert np.allclose(back, positions.reshape(-1, 2)) and np.allclose(t, 2.5)


def test_samples_are_uniform_and_depend_on_their_pixel_alone():
    y, x = np.mgrid[-1:30, -2:40]
    pixels = np.stack([x.reshape(-1), y.reshape(-1)], axis=1)
    samples = jittered(pixels, 9, seed=4)
    within = samples.reshape(-1, 9, 2) - pixels[:, None]
    assert within.min() >= 0 and within.max() < 1
    assert np.histogram2d(*within.reshape(-1, 2).T, bins=3, range=[[0, 1]] * 2)[0].std() == 0
    assert abs((within * 3 % 1).mean() - 0.5) < 0.01
    assert np.array_equal(jittered(pixels[7:9], 9, seed=4), samples[63:81])
    means = np.mean([jittered(pixels, 16, seed=seed).reshape(-1, 16, 2).mean(axis=1) for seed in range(16)], axis=0)
    spread = np.sqrt(1 / 12) / 4 / np.sqrt(16 * 16)  # of 256 independent samples, each in a quarter of its pixel's side
    assert (means - pixels - 0.5).std() == pytest.approx(spread, rel=0.1)


@pytest.mark.sweep(1)
@pytest.mark.parametrize(("degree", "tube"), [(2, 0.05), (3, 0.4), (2, 1.5), (3, 5.0), (2, 18.0)])
def test_the_tube_estimator_is_unbiased_for_each_width(degree, tube):
    """The length of the outline of a ball, an ellipse in general; here, a circle around the middle."""
    surface = isospline.Isosurface(volumes.sphere(0.6).volume(32, degree=degree), volumes.sphere(0.6).level)
    camera = isospline.PerspectiveCamera((3, 0.3, 0.2), (0, 0, 0), field_of_view=30)
    y, x = np.mgrid[-20:84, -20:84]
    samples = Samples(jittered(np.stack([x.reshape(-1), y.reshape(-1)], axis=1), 16, seed=1))
    feet = Outlines(surface, Film.of_camera(camera, (64, 64)), samples, tube).feet(samples)
    distance = np.linalg.norm([3, 0.3, 0.2])
    radius = 0.6 / np.sqrt(distance**2 - 0.36) * 32 / np.tan(np.radians(15))
    length = (1 / feet.stretch / feet.widths).sum() / (2 * 16)
    assert feet.widths.max() == pytest.approx(min(tube, radius / 2), rel=1e-2)
    assert np.abs(np.linalg.norm(feet.positions - 32, axis=1) - radius).max() < 1e-3
    assert length == pytest.approx(2 * np.pi * radius, rel=2.5 / np.sqrt(len(feet.t)))


def test_a_ball_covers_a_picture_by_its_level_and_place():
    field = volumes.sphere(0.6)  # its values are 0.36 - r^2
    scene = placed(isospline.Isosurface(field.volume(40, degree=3), field.level))
    camera = isospline.OrthographicCamera((3, 0, 0), (0, 0, 0), height=2)
    picture, vjp = picture_vjp(scene, camera, (64, 64), samples_per_pixel=64)
    pixel = (2 / 64) ** 2
    assert picture.sum() * pixel == pytest.approx(np.pi * 0.36, rel=1e-3)
    found = vjp(np.full((64, 64), pixel))
    assert found["levels"][0] == pytest.approx(-np.pi, rel=5e-3)
    assert found["samples"][0].sum() == pytest.approx(np.pi, rel=5e-3)
    to_the_right = np.broadcast_to((np.arange(64) + 0.5) / 32 - 1, (64, 64))
    by_place = vjp(to_the_right * pixel, samples=False)  # the moment: it grows by the area for a unit of y
    assert by_place["transforms"][0][1, 3] == pytest.approx(np.pi * 0.36, rel=1e-2)
    assert by_place["camera"][1, 3] == pytest.approx(-np.pi * 0.36, rel=1e-2)


def statistics(numbers):
    return np.mean(numbers), np.std(numbers) / np.sqrt(len(numbers) - 1)


CUT = {"clip": isospline.Box((-0.5, -0.4, -1), (0.5, 0.9, 0.15)), "capped": True}
FIELD = volumes.torus(0.6, 0.25)
GRID = {**FIELD.grid((24, 24, 24)), "degree": 3}
DATA = FIELD.values((24, 24, 24))


@pytest.mark.parametrize(
    "channel", [*(pytest.param(each, marks=pytest.mark.long) for each in ("mask", "depth", "normals")), PHONG]
)
def test_gradients_are_those_of_converged_pictures(channel):
    """By the level, samples, a placement and the camera; both sides are random, so their errors are estimated."""
    channels = 1 if channel in ("mask", "depth") else 3
    y, x = np.mgrid[0 : SIZE[1], 0 : SIZE[0]]
    waves = [1.5 + np.sin(0.15 * x + k) * np.cos(0.2 * y - k) for k in range(channels)]
    weights = np.stack(waves, axis=-1).reshape((SIZE[1], SIZE[0], channels)[: 2 + (channels > 1)])
    bump = np.exp(-((np.stack(np.meshgrid(*[np.linspace(-1, 1, 24)] * 3, indexing="ij")) - 0.3) ** 2).sum(0) * 3)

    def scene(level=0.0, samples=0.0, transform=0.0):
        volume = isospline.Volume(DATA + samples * bump, **GRID)
        return placed(isospline.Isosurface(volume, FIELD.level + level, **CUT), np.eye(4) + transform * CHANGE)

    def total(seed, **changes):
        picture, _ = picture_vjp(scene(**changes), CAMERA, SIZE, channel, samples_per_pixel=225, seed=seed)
        return (picture * weights).sum()

    found = {"level": [], "samples": [], "transform": []}
    for seed in range(4):
        picture, vjp = picture_vjp(scene(), CAMERA, SIZE, channel, samples_per_pixel=25, seed=seed)
        gradients = vjp(weights)
        found["level"].append(gradients["levels"][0])
        found["samples"].append((gradients["samples"][0] * bump).sum())
        found["transform"].append((gradients["transforms"][0] * CHANGE).sum())
        if channel == "mask":  # what a camera sees does not change if all moves with it
            assert (gradients["camera"] * CHANGE).sum() == pytest.approx(-found["transform"][-1])
    for name, step in (("level", 4e-3), ("samples", 4e-3), ("transform", 1e-2)):
        seeds = range(6 if channel == "normals" else 3)  # their differences are noisy
        slopes = [(total(seed, **{name: step}) - total(seed, **{name: -step})) / (2 * step) for seed in seeds]
        mean, error = statistics(found[name])
        expected, its_error = statistics(slopes)
        size = np.abs(found["level"]).mean() * (0.01 if name == "level" else 0.004)
        assert mean == pytest.approx(expected, abs=4 * np.hypot(error, its_error) + size), name


def box_volume():
    return isospline.Volume(np.ones((4, 4, 4)), spacing=(0.4, 0.4, 0.3), origin=(-0.6, -0.5, -0.4))


def box_mesh():
    corners = np.array(list(itertools.product((-0.6, 0.5), (-0.7, 0.4), (-0.5, 0.8))))
    faces = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1)]
    return isospline.Mesh(corners, [*faces, (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)])


@pytest.mark.parametrize("item", [isospline.Isosurface(box_volume(), 0.0, closed=True), box_mesh()])
def test_straight_edges_of_caps_and_meshes_move_with_their_object(item):
    bounds = box_volume().bounds if isinstance(item, isospline.Isosurface) else item.bounds
    corners = np.array(list(itertools.product(*bounds.T)))
    film = Film.of_camera(CAMERA, SIZE)

    def area(transform):
        return convex_outline(film.project(corners @ transform[:3, :3].T + transform[:3, 3])[0])

    expected = (area(np.eye(4) + 1e-6 * CHANGE) - area(np.eye(4) - 1e-6 * CHANGE)) / 2e-6
    found = []
    for seed in range(6):
        _, vjp = picture_vjp(placed(item), CAMERA, SIZE, samples_per_pixel=36, seed=seed)
        found.append((vjp(np.ones(SIZE[::-1]), samples=False)["transforms"][0] * CHANGE).sum())
    mean, error = statistics(found)
    assert mean == pytest.approx(expected, abs=4 * error)


def test_edges_with_a_corner_on_one_side_count_once():
    mesh = box_mesh()
    middle = len(mesh.vertices) + np.arange(6)
    a, b, c = mesh.faces[::2].T
    halves = np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1), mesh.faces[1::2]])
    vertices = np.concatenate([mesh.vertices, 0.5 * (mesh.vertices[a] + mesh.vertices[b])])
    for channel, ones in (("mask", np.ones(SIZE[::-1])), ("normals", np.ones((*SIZE[::-1], 3)))):
        gradients = [
            picture_vjp(placed(each), CAMERA, SIZE, channel)[1](ones)["transforms"][0]
            for each in (mesh, isospline.Mesh(vertices, halves))
        ]
        assert np.allclose(*gradients)


def test_the_order_of_corners_hides_no_outline():
    mesh = box_mesh()
    faces = np.where(np.arange(12)[:, None] % 2 == 0, mesh.faces, mesh.faces[:, ::-1])
    gradients = [
        picture_vjp(placed(each), CAMERA, SIZE)[1](np.ones(SIZE[::-1]))["transforms"][0]
        for each in (mesh, isospline.Mesh(mesh.vertices, faces))
    ]
    assert np.abs(gradients[0]).max() > 10 and np.allclose(*gradients)


def test_creases_of_meshes_with_normals_move_with_their_object():
    """Rays find the normals of faces, so the sum of a picture of normals is that of the seen faces' areas."""
    mesh, weights = box_mesh(), np.array([1.0, -0.7, 0.4])
    film = Film.of_camera(CAMERA, SIZE)
    rounded = isospline.Mesh(mesh.vertices, mesh.faces, normals=mesh.vertices)

    def total(transform):
        linear = transform[:3, :3]
        corners = mesh.vertices[mesh.faces] @ linear.T + transform[:3, 3]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        seen = ((CAMERA.eye - corners[:, 0]) * normals).sum(axis=1) > 0
        a, b, c = film.project(corners[seen].reshape(-1, 3))[0].reshape(-1, 3, 2).transpose(1, 0, 2)
        areas = 0.5 * np.abs([turn(first, second) for first, second in zip(b - a, c - a)])
        return (areas * (normals[seen] @ weights)).sum()

    expected = (total(np.eye(4) + 1e-6 * CHANGE) - total(np.eye(4) - 1e-6 * CHANGE)) / 2e-6
    found = []
    for seed in range(6):
        picture, vjp = picture_vjp(placed(rounded), CAMERA, SIZE, "normals", samples_per_pixel=16, seed=seed)
        assert (picture @ weights).sum() == pytest.approx(total(np.eye(4)), rel=0.01)
        by_place = vjp(np.broadcast_to(weights, picture.shape), samples=False)["transforms"][0]
        found.append((by_place * CHANGE).sum())
    mean, error = statistics(found)
    assert mean == pytest.approx(expected, abs=4 * error) and error < 0.05 * abs(expected)


@pytest.mark.parametrize("channel", ["mask", "depth"])
def test_what_hides_an_outline_hides_its_motion(channel):
    field = volumes.sphere(0.5)
    behind = isospline.Isosurface(field.volume(24), field.level)
    wall = isospline.Mesh([(2, -3, -3), (2, 3, -3), (2, 3, 3), (2, -3, 3)], [(0, 1, 2), (0, 2, 3)])
    _, vjp = picture_vjp(isospline.Scene([behind, wall]), CAMERA, SIZE, channel)
    assert vjp(np.ones(SIZE[::-1]), samples=False)["levels"] == {0: 0.0}


def test_outlines_in_cells_of_many_pixels_are_found():
    """A close view of the top of a ball: cells are 160 pixels wide, and the outline is an arc."""
    field = volumes.sphere(0.6)
    scene = placed(isospline.Isosurface(field.volume(8, degree=3), field.level))
    camera = isospline.OrthographicCamera((3, 0, 0.6), (0, 0, 0.6), height=0.05)
    steps = [
        picture_vjp(placed(isospline.Isosurface(scene.object(0).volume, field.level + step)), camera, (32, 32))[0]
        for step in (-1e-3, 1e-3)
    ]
    _, vjp = picture_vjp(scene, camera, (32, 32), samples_per_pixel=16)
    slope = vjp(np.ones((32, 32)), samples=False)["levels"][0]
    assert slope == pytest.approx((steps[1] - steps[0]).sum() / 2e-3, rel=0.05)


def test_cells_behind_the_camera_are_not_searched():
    volume = isospline.Volume(DATA, **GRID)
    camera = isospline.PerspectiveCamera((0.6, 0, 0), (0.6, 1, 0.1), field_of_view=60)  # inside of the torus
    samples = Samples(jittered(np.argwhere(np.ones((30, 30))), 1, seed=0))
    outlines = Outlines(isospline.Isosurface(volume, FIELD.level), Film.of_camera(camera, (30, 30)), samples, 1.0)
    assert len(outlines.curves)
    for _, starts in outlines.curves:
        along = (starts - camera.eye) @ camera.world_to_camera[2, :3]
        assert along.min() > -2 * np.linalg.norm(volume.spacing)  # those of cells around the eye may be behind it


def test_edges_that_pass_the_camera_are_cut():
    corners = [(-9, -9, -1), (9, -9, -1), (9, 9, -1), (-9, 9, -1)]
    floor = isospline.Mesh(corners, [(0, 1, 2), (0, 2, 3)])
    camera = isospline.PerspectiveCamera((3, 0, 0.5), (0, 0, 0), field_of_view=50)
    up = np.zeros((4, 4))
    up[2, 3] = 1
    totals = [
        picture_vjp(placed(floor, np.eye(4) + step * up), camera, SIZE, samples_per_pixel=100)[0].sum()
        for step in (-0.02, 0.02)
    ]
    _, vjp = picture_vjp(placed(floor), camera, SIZE, samples_per_pixel=25)
    found = vjp(np.ones(SIZE[::-1]), samples=False)["transforms"][0][2, 3]
    assert found == pytest.approx((totals[1] - totals[0]) / 0.04, rel=0.03)


def test_planes_that_coincide_and_triangles_without_common_corners_count_once():
    volume = isospline.Volume(DATA, **GRID)
    level = FIELD.level - 0.25  # the torus runs into the sides of the volume
    slopes = []
    for options in ({}, {"clip": isospline.Box(*volume.bounds)}):
        _, vjp = picture_vjp(placed(isospline.Isosurface(volume, level, **options)), CAMERA, SIZE, samples_per_pixel=4)
        slopes.append(vjp(np.ones(SIZE[::-1]), samples=False)["levels"][0])
    assert slopes[1] == pytest.approx(slopes[0], rel=1e-6)
    mesh = box_mesh()
    soup = isospline.Mesh(mesh.vertices[mesh.faces].reshape(-1, 3), np.arange(36).reshape(12, 3))
    gradients = [
        picture_vjp(placed(each), CAMERA, SIZE)[1](np.ones(SIZE[::-1]))["transforms"][0] for each in (mesh, soup)
    ]
    assert np.allclose(*gradients)


def seen(rng, count=50):
    normals = rng.normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    rays = rng.normal(size=(count, 6))
    sides = np.where((normals * rays[:, 3:]).sum(axis=1, keepdims=True) > 0, -1.0, 1.0)
    return Seen(rng.uniform(1, 2, count), normals, rays, sides)


def test_phong_colors_are_differentiated():
    rng, shade = np.random.default_rng(0), PhongShade(PHONG)
    at = seen(rng)
    by_values = rng.normal(size=(50, 3))
    of = shade.vjp(at, by_values)

    def slope(name, change):
        values = []
        for step in (1e-6, -1e-6):
            moved = Seen(**{**vars(at), name: getattr(at, name) + step * change})
            values.append((shade.values(moved) * by_values).sum(axis=1))
        return (values[0] - values[1]) / 2e-6

    assert np.allclose(of.t, slope("t", 1.0), atol=1e-6)
    for axis in range(3):
        assert np.allclose(of.normals[:, axis], slope("normals", np.eye(3)[axis]), atol=1e-6)
    for axis in range(6):
        assert np.allclose(of.rays[:, axis], slope("rays", np.eye(6)[axis]), atol=1e-6)


def test_a_phong_picture_is_the_renderers():
    surface = isospline.Isosurface(isospline.Volume(DATA, **GRID), FIELD.level)
    picture, _ = picture_vjp(placed(surface), CAMERA, SIZE, PHONG, samples_per_pixel=400)
    image = isospline.render(surface, CAMERA, size=SIZE, light=PHONG, samples=400, background=(0, 0, 0))
    assert np.abs(picture - image.color[..., :3]).mean() < 2e-3


def test_depth_is_the_renderers():
    surface = isospline.Isosurface(isospline.Volume(DATA, **GRID), FIELD.level)
    for camera in (CAMERA, isospline.OrthographicCamera((3, 1, 2), (0, 0, 0), height=2), PLANE_CAMERA):
        depths, _ = picture_vjp(placed(surface), camera, SIZE, "depth", samples_per_pixel=100)
        image = isospline.render(surface, camera, size=SIZE, light=PHONG, layers=("depth",))
        inside = np.isfinite(image.depth) & (depths > 0)
        assert np.median(np.abs(depths - image.depth)[inside]) < 5e-3  # means of pixels beside their middles


def test_wrong_arguments_get_one_sentence():
    scene = placed(isospline.Isosurface(isospline.Volume(DATA, **GRID), FIELD.level))
    with pytest.raises(TypeError, match="scene: expected a Scene, got int"):
        picture_vjp(3, CAMERA, SIZE)
    with pytest.raises(TypeError, match="camera: expected .*, got a PanoramicCamera"):
        picture_vjp(scene, isospline.PanoramicCamera((3, 0, 0), (0, 0, 0)), SIZE)
    with pytest.raises(ValueError, match='channel: expected "mask", "depth", "normals" or a Phong, got \'color\''):
        picture_vjp(scene, CAMERA, SIZE, "color")
    with pytest.raises(ValueError, match="channel: expected a Phong with lights"):
        picture_vjp(scene, CAMERA, SIZE, isospline.Phong())
    with pytest.raises(ValueError, match="tube: expected a number above 0 and at most 64"):
        picture_vjp(scene, CAMERA, SIZE, tube=0.0)
    with pytest.raises(ValueError, match="samples_per_pixel: expected 1 to 65536, got 0"):
        picture_vjp(scene, CAMERA, SIZE, samples_per_pixel=0)
    with pytest.raises(TypeError, match="size: expected a whole number, got 3.5"):
        picture_vjp(scene, CAMERA, (3.5, 2))
    with pytest.raises(ValueError, match="size: expected width and height, got 3"):
        picture_vjp(scene, CAMERA, 3)
    with pytest.raises(ValueError, match="seed: expected 0 to"):
        picture_vjp(scene, CAMERA, SIZE, seed=-1)
    with pytest.raises(ValueError, match="background: expected a finite number or 1 of them"):
        picture_vjp(scene, CAMERA, SIZE, background=(1, 2))
    with pytest.raises(ValueError, match="scene: expected volumes of degree 2 or 3"):
        picture_vjp(placed(isospline.Isosurface(FIELD.volume(12, degree=1), FIELD.level)), CAMERA, SIZE)
    _, vjp = picture_vjp(scene, CAMERA, SIZE)
    with pytest.raises(ValueError, match="picture: expected gradients of shape"):
        vjp(np.ones(SIZE))


def test_a_scene_that_has_changed_is_noticed():
    surface = isospline.Isosurface(isospline.Volume(DATA, **GRID), FIELD.level)
    _, vjp = picture_vjp(placed(surface), CAMERA, SIZE)
    surface.level = -0.1
    with pytest.raises(RuntimeError, match="scene: expected one that has not changed"):
        vjp(np.ones(SIZE[::-1]))
    scene = placed(surface)
    _, vjp = picture_vjp(scene, CAMERA, SIZE)
    scene.set_visibility(0, visible=False)
    with pytest.raises(RuntimeError, match="scene: expected one that has not changed"):
        vjp(np.ones(SIZE[::-1]))
