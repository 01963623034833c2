"""Capped cuts against closed forms: hits, no leaks, points inside, colours."""

import itertools
import warnings

import numpy as np
import pytest
from analytic_volumes import Gyroid
from hit_outputs import ALL_OUTPUTS
from layered import render

import isospline
from isospline.colors import linear

RADIUS = 6.3
#: The kept part of the ball: one side of an oblique plane.
NORMAL = np.array((0.36, -0.48, -0.8))
HEIGHT = -2.1
CUT = isospline.HalfSpace(HEIGHT * NORMAL, NORMAL)


def ball(radius=RADIUS, clip=CUT, **options):
    """f = |x|^2; a quadratic model holds it exactly outside the reach of the boundary rule."""
    z, y, x = np.mgrid[-16:17, -16:17, -16:17].astype(float)
    volume = isospline.Volume(x**2 + y**2 + z**2, origin=(-16, -16, -16))
    return isospline.research.isosurface(volume, radius**2, inside="below", clip=clip, capped=True, **options)


def gyroid(degree=2, clip="border", **options):
    """A solid that extends to the border of its volume, which is not aligned with unit cells of the world's axes."""
    volume = isospline.Volume(Gyroid(11.0).values((26, 25, 24)), spacing=(0.7, 0.9, 1.1), degree=degree)
    if isinstance(clip, str):
        clip = isospline.Box(*volume.bounds)
    return isospline.research.isosurface(volume, 0.1, clip=clip, capped=True, **options)


def rays_at(rng, targets, reach):
    """Rays from all around to given points."""
    origins = rng.normal(size=targets.shape)
    origins *= reach / np.linalg.norm(origins, axis=-1, keepdims=True)
    return np.concatenate([origins, targets - origins], axis=-1)


def points_in_ball(rng, count, radius=RADIUS):
    points = rng.uniform(-radius, radius, (4 * count, 3))
    points = points[(points**2).sum(-1) < radius**2]
    return points[points @ NORMAL > HEIGHT][:count]


def chords(rays):
    """Entry and exit of rays for the cut ball, and whether each is on the plane; NaN for misses."""
    origin, direction = rays[:, :3], rays[:, 3:]
    a, b, c = (direction**2).sum(-1), (origin * direction).sum(-1), (origin**2).sum(-1) - RADIUS**2
    root = np.sqrt(np.where(b**2 > a * c, b**2 - a * c, np.nan))
    enter, leave = (-b - root) / a, (-b + root) / a
    speed = direction @ NORMAL
    plane = (HEIGHT - origin @ NORMAL) / speed
    enters_plane, leaves_plane = (speed > 0) & (plane > enter), (speed < 0) & (plane < leave)
    enter, leave = np.where(enters_plane, plane, enter), np.where(leaves_plane, plane, leave)
    missed = ~(enter < leave)
    enter[missed] = leave[missed] = np.nan
    return enter, leave, enters_plane & ~missed, leaves_plane & ~missed


def test_a_cut_ball_is_the_closed_form(rng):
    surface = ball()
    scene = isospline.Scene([surface])
    rays = rays_at(rng, rng.uniform(-8, 8, (50_000, 3)), 40.0)
    enter, leave, enters_plane, leaves_plane = chords(rays)
    clear = ~(np.nan_to_num(leave - enter, nan=1) * np.linalg.norm(rays[:, 3:], axis=-1) < 0.05)
    clear &= np.abs(np.nan_to_num((rays[:, 3:] @ NORMAL) / np.linalg.norm(rays[:, 3:], axis=-1))) > 1e-3

    hits = scene.cast_rays(rays, outputs=ALL_OUTPUTS)
    there = np.isfinite(hits["t_hit"])
    grazing = there != np.isfinite(enter)
    assert grazing.sum() < 20 and not (grazing & clear & there).any()
    cap = hits["primitive_ids"] == surface.volume.cell_count
    on_cap = there & cap & clear
    assert on_cap.sum() > 5000 and (there & ~cap).sum() > 5000
    np.testing.assert_array_equal(cap[clear & there], enters_plane[clear & there])
    np.testing.assert_allclose(hits["t_hit"][on_cap], enter[on_cap], rtol=1e-12)
    np.testing.assert_allclose(hits["t_hit"][there & clear], enter[there & clear], rtol=1e-5)
    np.testing.assert_allclose(hits["positions"][on_cap] @ NORMAL, HEIGHT, atol=1e-12)
    np.testing.assert_allclose(hits["primitive_normals"][on_cap], np.tile(-NORMAL, (on_cap.sum(), 1)), atol=1e-14)
    radii = np.linalg.norm(hits["positions"][on_cap], axis=-1)
    np.testing.assert_allclose(hits["gradient_magnitudes"][on_cap], 2 * radii, rtol=1e-4)
    assert (hits["primitive_uvs"][on_cap] == 0).all()

    crossings = scene.list_intersections(rays)
    begin, count = crossings["ray_splits"][:-1], np.diff(crossings["ray_splits"])
    assert (count[clear & there] == 2).all()
    last = begin[clear & there] + 1
    np.testing.assert_allclose(crossings["t_hit"][last], leave[clear & there], rtol=1e-5)
    on_cap = crossings["primitive_ids"][last] == surface.volume.cell_count
    np.testing.assert_array_equal(on_cap, leaves_plane[clear & there])


def test_the_area_of_a_cap():
    """Parallel rays on a grid, perpendicular to the disc."""
    count = 1000
    u = np.cross(NORMAL, (0, 0, 1))
    u /= np.linalg.norm(u)
    v = np.cross(NORMAL, u)
    step = 2 * RADIUS / count
    grid = (np.arange(count) + 0.5) * step - RADIUS
    origins = grid[:, None, None] * u + grid[None, :, None] * v - 20 * NORMAL
    rays = np.concatenate([origins, np.broadcast_to(NORMAL, origins.shape)], axis=-1)
    surface = ball()
    hits = isospline.Scene([surface]).cast_rays(rays, coherent=True)
    area = (hits["primitive_ids"] == surface.volume.cell_count).sum() * step**2
    assert area == pytest.approx(np.pi * (RADIUS**2 - HEIGHT**2), rel=1e-4)


def rim_points(surface, rng, count):
    """Points of the ball's rim, where its surface meets the plane, to the precision of doubles."""
    u = np.cross(NORMAL, (0, 0, 1))
    u /= np.linalg.norm(u)
    v = np.cross(NORMAL, u)
    angle = rng.uniform(0, 2 * np.pi, count)
    outwards = np.cos(angle)[:, None] * u + np.sin(angle)[:, None] * v
    radius = np.full(count, np.sqrt(RADIUS**2 - HEIGHT**2))
    for _ in range(4):
        points = HEIGHT * NORMAL + radius[:, None] * outwards
        value = surface.volume.sample(points) - surface.level
        slope = (surface.volume.sample(points, derivative=1) * outwards).sum(-1)
        radius -= value / slope
    return HEIGHT * NORMAL + radius[:, None] * outwards


@pytest.mark.slow
@pytest.mark.parametrize(
    "method, count",
    [("exact", 200_000), ("reference", 50_000), pytest.param("exact", 1_000_000, marks=pytest.mark.long)],
)
def test_nothing_leaks_through_the_rim(rng, method, count):
    """Many rays from inside to points of the rim; by rounding, they pass on either side of it."""
    surface = ball(method=method)
    scene = isospline.Scene([surface])
    rim = rim_points(surface, rng, count)
    inside = points_in_ball(rng, count, 0.98 * RADIUS)
    inside = inside[np.arange(count) % len(inside)]
    rays = np.concatenate([inside, rim - inside], axis=-1)
    single, packets = (scene.cast_rays(rays, coherent=coherent) for coherent in (False, True))
    assert np.abs(single["t_hit"] - 1).max() < 1e-6
    cap = single["primitive_ids"] == surface.volume.cell_count
    assert cap.sum() > count / 10 and (~cap).sum() > count / 10
    for name in single:
        np.testing.assert_array_equal(single[name], packets[name], err_msg=name)
    assert all(scene.test_occlusions(rays, coherent=coherent).all() for coherent in (False, True))
    assert (scene.count_intersections(rays) == 1).all()
    assert (scene.count_intersections(rays_at(rng, rim, 40.0)) % 2 == 0).all()


CLOSED = {
    "ball": lambda: ball(),
    "ball in a box": lambda: ball(clip=[isospline.Box((-5, -2, -7), (3, 7, 4)), CUT]),
    "box in a ball": lambda: ball(clip=isospline.Box((-3, -2, -3.5), (3, 2.5, 1))),
    "gyroid, degree 1": lambda: gyroid(1),
    "gyroid, degree 2": lambda: gyroid(2),
    "gyroid, degree 3": lambda: gyroid(3),
    "gyroid below": lambda: gyroid(inside="below"),
    "gyroid, reference": lambda: gyroid(method="reference"),
    "corner of a gyroid": lambda: gyroid(
        clip=[isospline.Box((2, 2, 2), (14, 17, 20)), isospline.HalfSpace((8, 8, 8), (1, -2, 0.5))]
    ),
}


@pytest.fixture(scope="module", params=CLOSED)
def closed(request):
    return CLOSED[request.param]()


def around(surface, rng, count):
    """Points around a surface's volume, and rays from them."""
    lower, upper = surface.volume.bounds
    points = rng.uniform(lower - 1, upper + 1, (count, 3))
    return points, np.concatenate([points, rng.normal(size=points.shape)], axis=-1)


def test_contains_agrees_with_counts_of_crossings(closed, rng):
    points, rays = around(closed, rng, 40_000)
    inside = closed.contains(points)
    assert 100 < inside.sum() < 39_000
    scene = isospline.Scene([closed])
    np.testing.assert_array_equal(scene.count_intersections(rays) % 2 == 1, inside)
    assert np.isfinite(scene.cast_rays(rays[inside])["t_hit"]).all()


@pytest.mark.slow
def test_all_queries_agree(closed, rng):
    _, rays = around(closed, rng, 15_000)
    scene = isospline.Scene([closed])
    single, packets = (scene.cast_rays(rays, coherent=coherent, outputs=ALL_OUTPUTS) for coherent in (False, True))
    for name in single:
        np.testing.assert_array_equal(single[name], packets[name], err_msg=name)
    hit = np.isfinite(single["t_hit"])
    for coherent in (False, True):
        np.testing.assert_array_equal(scene.test_occlusions(rays, coherent=coherent), hit)

    crossings = scene.list_intersections(rays)
    begin, end = crossings["ray_splits"][:-1], crossings["ray_splits"][1:]
    np.testing.assert_array_equal(end > begin, hit)
    first = begin[hit]
    np.testing.assert_allclose(crossings["t_hit"][first], single["t_hit"][hit], rtol=1e-9, atol=1e-9)
    cap = crossings["primitive_ids"] >= closed.volume.cell_count
    np.testing.assert_array_equal(cap[first], single["primitive_ids"][hit] >= closed.volume.cell_count)
    assert cap.sum() > 300
    direction = rays[crossings["ray_ids"], 3:]
    np.testing.assert_array_equal(
        crossings["entering"][cap], (crossings["primitive_normals"] * direction).sum(-1)[cap] < 0
    )
    # Entries and exits alternate, and the last crossing is an exit.
    same_ray = crossings["ray_ids"][1:] == crossings["ray_ids"][:-1]
    assert (crossings["entering"][1:] != crossings["entering"][:-1])[same_ray].all()
    assert not crossings["entering"][end[hit] - 1].any()
    assert (np.diff(crossings["t_hit"])[same_ray] >= 0).all()

    half = scene.count_intersections(rays, t_far=0.5) + scene.count_intersections(rays, t_near=0.5)
    np.testing.assert_array_equal(half, end - begin)


def test_packets_are_single_rays_at_rims(closed, rng):
    """Bundles of rays at points of the caps' rims, where cells and caps meet."""
    scene = isospline.Scene([closed])
    lower, upper = closed.volume.bounds
    crossings = scene.list_intersections(around(closed, rng, 4000)[1])
    on_cap = crossings["positions"][crossings["primitive_ids"] >= closed.volume.cell_count][:4000]
    rays = rays_at(rng, on_cap, 50.0).repeat(16, axis=0)
    rays[:, 3:] += rng.normal(scale=0.3, size=(len(rays), 3))
    single, packets = (scene.cast_rays(rays, coherent=coherent) for coherent in (False, True))
    caps = single["primitive_ids"][np.isfinite(single["t_hit"])] >= closed.volume.cell_count
    assert caps.mean() > 0.02
    for name in single:
        np.testing.assert_array_equal(single[name], packets[name], err_msg=name)


def test_a_box_in_the_solid_is_a_box(rng):
    """No cell of the shell is left, and every face is a cap."""
    lower, upper = np.array((-2.3, -2, -2.6)), np.array((2.4, 2.2, 1))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        surface = ball(clip=isospline.Box(lower, upper))
    assert surface.shell.count == 0 and surface.capped
    scene = isospline.Scene([surface])
    np.testing.assert_allclose(scene.bounds, [lower, upper], atol=1e-5)
    rays = rays_at(rng, rng.uniform(-4, 4, (20_000, 3)), 30.0)
    hits = scene.cast_rays(rays)
    t = (np.stack([lower, upper]) - rays[:, None, :3]) / rays[:, None, 3:]
    enter, leave = t.min(1).max(-1), t.max(1).min(-1)
    hit = enter < leave
    np.testing.assert_array_equal(np.isfinite(hits["t_hit"]), hit)
    np.testing.assert_allclose(hits["t_hit"][hit], enter[hit], rtol=1e-12)
    axis = t.min(1).argmax(-1)[hit]
    face = 2 * axis + (np.take_along_axis(rays[hit, 3:], axis[:, None], 1)[:, 0] < 0)
    np.testing.assert_array_equal(hits["primitive_ids"][hit], surface.volume.cell_count + face)
    normals = np.zeros((hit.sum(), 3))
    normals[np.arange(hit.sum()), axis] = np.where(face % 2 == 0, -1, 1)
    np.testing.assert_array_equal(hits["primitive_normals"][hit], normals)


def test_rays_that_leave_a_cap(rng):
    """A cut ball is convex: rays outwards hit nothing, rays inwards end where the closed form says."""
    surface = ball()
    scene = isospline.Scene([surface])
    rim = rim_points(surface, rng, 100_000)
    # Points of the disc, denser towards the rim, down to rounding.
    nearness = 10 ** -rng.uniform(0, 15, len(rim))
    disc = rim + nearness[:, None] * (HEIGHT * NORMAL - rim) * rng.uniform(0, 1, (len(rim), 1))
    rays = rays_at(rng, disc, 30.0)
    rays = rays[(rays[:, 3:] @ NORMAL) > 0.1]
    hits = scene.cast_rays(rays)
    on_cap = hits["primitive_ids"] == surface.volume.cell_count
    rays, hits = rays[on_cap], {name: values[on_cap] for name, values in hits.items()}
    assert len(rays) > 20_000

    directions = rng.normal(size=(len(rays), 3))
    outwards = directions @ NORMAL < 0
    leaving = scene.secondary_rays(rays, hits, directions)
    found = scene.cast_rays(leaving)
    assert np.isinf(found["t_hit"][outwards]).all()
    np.testing.assert_array_equal(scene.test_occlusions(leaving), ~outwards)
    inwards = ~outwards
    assert np.isfinite(found["t_hit"][inwards]).all()
    assert not (found["primitive_ids"] == surface.volume.cell_count).any()
    moved = np.linalg.norm(leaving[:, :3] - (rays[:, :3] + hits["t_hit"][:, None] * rays[:, 3:]), axis=-1)
    assert 0 < moved.max() < 1e-9
    expected = chords(leaving)[1]
    far = inwards & (expected * np.linalg.norm(directions, axis=-1) > 0.5)
    assert far.sum() > 5000
    np.testing.assert_allclose(found["t_hit"][far], expected[far], rtol=1e-3)


def test_rays_that_leave_the_surface_next_to_a_cap(rng):
    """Rays inwards from hits next to the rim never hit the adjacent cap first because of rounding."""
    surface = ball()
    scene = isospline.Scene([surface])
    rim = rim_points(surface, rng, 100_000)
    outwards = rim - HEIGHT * NORMAL
    beside = rim + 10 ** -rng.uniform(1, 16, (len(rim), 1)) * NORMAL
    rays = np.concatenate([beside + outwards, -outwards], axis=-1)
    hits = scene.cast_rays(rays)
    there = hits["primitive_ids"] < surface.volume.cell_count
    rays, hits = rays[there], {name: values[there] for name, values in hits.items()}
    assert len(rays) > 50_000
    directions = -hits["primitive_normals"] + rng.uniform(-0.4, 0.4, rays[:, 3:].shape)
    directions += np.maximum(0.05 - directions @ NORMAL, 0)[:, None] * NORMAL
    inwards = (directions * hits["primitive_normals"]).sum(-1) < -0.1
    found = scene.cast_rays(scene.secondary_rays(rays, hits, directions))
    length = found["t_hit"] * np.linalg.norm(directions, axis=-1)
    assert inwards.sum() > 10_000 and (length[inwards] > 0.1).all()


def test_cuts_follow_the_transform(rng):
    surface = ball(clip=[isospline.Box((-5, -2, -7), (3, 7, 4)), CUT])
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    transform = np.eye(4)
    transform[:3, :3] = turn * (1.5, 0.8, 1.2)
    transform[:3, 3] = (40, -30, 20)
    placed, plain = isospline.Scene(), isospline.Scene([surface])
    placed.add(surface, transform=transform)
    rays = rays_at(rng, rng.uniform(-8, 8, (20_000, 3)), 40.0)
    linear = transform[:3, :3].T
    moved = np.concatenate([rays[:, :3] @ linear + transform[:3, 3], rays[:, 3:] @ linear], axis=-1)
    expected, hits = plain.cast_rays(rays, outputs=ALL_OUTPUTS), placed.cast_rays(moved, outputs=ALL_OUTPUTS)
    same = expected["primitive_ids"] == hits["primitive_ids"]
    assert (~same).sum() < 10  # rays that graze
    hit = same & np.isfinite(expected["t_hit"])
    cap = hit & (hits["primitive_ids"] >= surface.volume.cell_count)
    assert cap.sum() > 4000
    np.testing.assert_allclose(hits["t_hit"][hit], expected["t_hit"][hit], rtol=1e-9)
    normals = expected["primitive_normals"][cap] @ np.linalg.inv(transform[:3, :3])
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    np.testing.assert_allclose(hits["primitive_normals"][cap], normals, atol=1e-12)


def test_open_surfaces_stay_open():
    """Capped cuts do not close the volume's border without a clip there, nor the cells that a mask removes."""
    z, y, x = np.mgrid[0:9, 0:9, 0:9].astype(float)
    volume = isospline.Volume(x + 10, degree=2)
    ray = [(4, 4, -9, 0, 0, 1)]
    halved = isospline.HalfSpace((0, 0, 4), (0, 0, 1))
    for options, count in ((dict(clip=halved), 1), (dict(clip=isospline.Box(*volume.bounds)), 2)):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            scene = isospline.Scene([isospline.Isosurface(volume, 5.0, capped=True, **options)])
        assert scene.count_intersections(ray) == count
    mask = x < 5
    masked = isospline.Isosurface(volume, 5.0, capped=True, clip=isospline.Box(*volume.bounds), mask=mask)
    scene = isospline.Scene([masked])
    assert scene.count_intersections([(3, 4, -9, 0, 0, 1), (6, 4, -9, 0, 0, 1)]).tolist() == [2, 0]
    for level in (3.0, 30.0):
        with pytest.warns(UserWarning, match="out of the data's range"):
            open_cut = isospline.Isosurface(volume, level, clip=halved)
        assert isospline.Scene([open_cut]).count_intersections(ray) == 0


def test_caps_follow_the_level():
    surface = ball(5.0)
    scene = isospline.Scene([surface])
    center = HEIGHT * NORMAL
    u = np.cross(NORMAL, (0, 0, 1))
    u /= np.linalg.norm(u)
    rays = np.concatenate([center + np.linspace(0, 8, 400)[:, None] * u - 20 * NORMAL, np.tile(NORMAL, (400, 1))], -1)
    for radius in (5.0, 7.0, 3.0):
        surface.level = radius**2
        hits = scene.cast_rays(rays)
        reach = (hits["primitive_ids"] == surface.volume.cell_count).sum() * 8 / 399
        assert reach == pytest.approx(np.sqrt(radius**2 - HEIGHT**2), abs=0.03)
        # Nothing remains of earlier levels.
        anew = isospline.Scene([ball(radius)])
        anew.cast_rays(rays)
        assert scene.memory == anew.memory


def test_the_cap_that_was_added_last_is_seen(rng):
    """Skin and bone cut by one plane: both caps are at exactly the same t."""
    skin, bone = ball(), ball(4.0)
    target = HEIGHT * NORMAL
    towards = np.concatenate([target - 20 * NORMAL + rng.uniform(-1.5, 1.5, (4096, 3)), np.tile(NORMAL, (4096, 1))], -1)
    for objects, expected in (((skin, bone), 1), ((bone, skin), 1)):
        scene = isospline.Scene(objects)
        for coherent in (False, True):
            hits = scene.cast_rays(towards, coherent=coherent)
            assert (hits["geometry_ids"] == expected).all()
            assert (hits["primitive_ids"] == objects[expected].volume.cell_count).all()
        crossings = scene.list_intersections(towards)
        assert (crossings["geometry_ids"][crossings["ray_splits"][:-1]] == expected).all()


GRAY = np.array([(0.0, 0.0, 0.0), (1.0, 1.0, 1.0)])
MODELS = {
    "Phong": lambda **options: isospline.Phong(color=linear((0.9, 0.6, 0.3)), **options),
    "Outline": lambda **options: isospline.Outline(surface_color=linear((0.9, 0.6, 0.3)), **options),
    "AmbientOcclusion": lambda **options: isospline.AmbientOcclusion(4, color=linear((0.9, 0.6, 0.3)), **options),
}


@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
def test_the_colour_of_caps(model):
    surface = ball()
    scene = isospline.Scene([surface])
    camera = isospline.PerspectiveCamera(-25 * NORMAL + (12, 18, 0), (0, 0, 0), field_of_view=32)
    values = isospline.ColorByVolume(surface.volume, GRAY, limits=(0, 50))
    image = render(scene, camera, size=(120, 90), light=model(cap_color=values), layers=("curvature",))
    cap, skin = image.primitive_ids == surface.volume.cell_count, image.primitive_ids < surface.volume.cell_count
    assert cap.sum() > 500 and skin.sum() > 300
    value = surface.volume.sample(image.position[cap].astype(float))
    np.testing.assert_allclose(image.albedo[cap], np.tile(value[:, None] / 50, 3), atol=1e-5)
    np.testing.assert_allclose(image.albedo[skin], np.tile((0.9, 0.6, 0.3), (skin.sum(), 1)), rtol=1e-6)
    np.testing.assert_allclose(image.normal[cap], np.tile(-NORMAL, (cap.sum(), 1)), atol=1e-6)
    assert not image.curvature[cap].any() and image.curvature[skin, 0].min() > 0.1

    plain = render(scene, camera, size=(120, 90), light=model())
    np.testing.assert_allclose(plain.albedo[cap], np.tile((0.9, 0.6, 0.3), (cap.sum(), 1)), rtol=1e-6)
    assert model(cap_color=0.5).cap_color.tolist() == [0.5] * 3 and model().cap_color is None
    with pytest.raises(ValueError, match="^cap_color: expected "):
        model(cap_color=-1)


def test_colours_of_caps_may_be_by_depth_and_curvature():
    scene = isospline.Scene([ball()])
    camera = isospline.PerspectiveCamera(-25 * NORMAL + (12, 18, 0), (0, 0, 0), field_of_view=32)
    by_depth = isospline.Phong(color=isospline.ColorByDepth(GRAY), cap_color=isospline.ColorByDepth(GRAY))
    same, split = (
        render(scene, camera, size=(60, 45), light=shading)
        for shading in (isospline.Phong(color=isospline.ColorByDepth(GRAY)), by_depth)
    )
    np.testing.assert_array_equal(same.albedo, split.albedo)
    assert np.ptp(same.albedo[same.geometry_ids == 0]) > 0.1


def test_a_translucent_cut_ball_has_two_layers_everywhere():
    surface = ball()
    camera = isospline.PerspectiveCamera(-25 * NORMAL + (12, 18, 0), (0, 0, 0), field_of_view=32)
    shading = isospline.Phong(opacity=0.25)
    image = render(isospline.Scene([surface]), camera, size=(120, 90), light=shading)
    hit = image.geometry_ids == 0
    assert hit.sum() > 1000
    np.testing.assert_allclose(image.color[hit, 3], 1 - 0.75**2, rtol=1e-6)


def test_white_furnace():
    """Paths that leave caps or the surface finally reach the even light; none is lost in the solid."""
    scene = isospline.Scene([CLOSED["corner of a gyroid"]()])
    integrator = isospline.PathTracer(isospline.Material(1, specular=0), max_bounces=10_000)
    camera = isospline.camera_for(scene, view=(-0.3, 1, -0.6))
    image = render(scene, camera, size=(80, 60), light=integrator, samples=4)
    assert (image.color[..., 3] == 1).sum() > 500
    np.testing.assert_allclose(image.color[..., :3], image.color[..., 3:] + np.zeros(3), atol=1e-6)


def test_hoppers_have_no_caps():
    with pytest.raises(
        ValueError,
        match="^surface: expected one without caps, as only scenes have them",
    ):
        isospline.research.VoxelHopper(ball())


def test_every_sign_of_the_box_is_named():
    """The primitive ids of a Box's faces, as the docs have them: lower x, upper x, lower y, ..."""
    surface = ball(clip=isospline.Box((-1, -1, -1), (1, 1, 1)))
    scene = isospline.Scene([surface])
    directions = [sign * axis for axis, sign in itertools.product(np.eye(3), (1.0, -1.0))]
    hits = scene.cast_rays([np.concatenate([-5 * direction, direction]) for direction in directions])
    assert (hits["primitive_ids"] - surface.volume.cell_count).tolist() == [0, 1, 2, 3, 4, 5]


@pytest.mark.parametrize("degree", [1, 2, 3])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_clip_that_keeps_a_face_alone_has_no_caps(degree, axis):
    field = np.sqrt(sum(grid**2 for grid in np.mgrid[-6:7, -6:7, -6:7]))
    volume = isospline.Volume(field, degree=degree)
    normal = np.eye(3)[axis]
    origin = volume.bounds[0] + 5.7
    origin[axis] = volume.bounds[1][axis] + 10
    middle = isospline.HalfSpace((6, 6, 6), normal), isospline.HalfSpace((6, 6, 6), -normal)
    for clip in ([isospline.HalfSpace(volume.bounds[1], normal)], list(middle)):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            surface = isospline.Isosurface(volume, 5.0, clip=clip, capped=True)
        scene = isospline.Scene([surface])
        ray = [(*origin, *-normal)]
        assert np.isinf(scene.cast_rays(ray)["t_hit"]).all() and not scene.test_occlusions(ray).any()
        assert scene.count_intersections(ray).tolist() == [0]
        assert float(surface.area()) == 0 and float(surface.enclosed_volume()) == 0
        assert len(surface.to_mesh().faces) == 0
        if len(clip) == 1:  # between two planes, a curve of the surface is left
            assert np.isinf(surface.closest_points([(20, 6, 6)])["distances"]).all()
