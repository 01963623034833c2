"""Isosurfaces and meshes that cut into each other, in one picture, against the closed form of spheres.

The faces of a mesh are between two spheres: the one through its vertices, and one that is smaller by the sagitta. If a
ray hits the same object first with both spheres, it hits the same object with the mesh. So the closed form decides
pixels without a tolerance, except pixels where the two spheres differ. The tests limit the number of these pixels, the
budget.
"""

import numpy as np
import pytest
from hit_outputs import ALL_OUTPUTS
from layered import render
from spheres import CENTER, mesh_sphere, moved, sagitta, sphere, sphere_t

import isospline

RADIUS = 6.0
GLOBE = mesh_sphere(RADIUS, 128)
SAGITTA = sagitta(GLOBE, RADIUS)
EXACT = 1e-6  # of the isosurface: the contract of hits
SIZE = (240, 180)
BUDGET = 20  # pixels; the sagitta is a fiftieth of a pixel wide
FLOOR = isospline.Mesh([(-40, -40, 0), (60, -40, 0), (60, 60, 0), (-40, 60, 0)], [(0, 1, 2), (0, 2, 3)])
LIGHTS = [isospline.PositionalLight((-25, -4, 25), intensity=0.9), isospline.DirectionalLight((-1, 0.2, -0.4))]
MATTE = isospline.Phong(ambient=0.125, diffuse=0.75, specular=0, lights=LIGHTS, shadows=True)


def placed(scale, angle, shear, center, about):
    """A transform that stretches, rotates about z, shears, and moves the point `about` to `center`."""
    cosine, sine = np.cos(angle), np.sin(angle)
    matrix = np.eye(4)
    matrix[:3, :3] = np.array([(cosine, -sine, shear), (sine, cosine, 0), (0, 0, 1)]) * scale
    matrix[:3, 3] = center - matrix[:3, :3] @ about
    return matrix


def two_spheres():
    """The camera, and the objects of the scene besides the floor, with their transforms."""
    camera = isospline.PerspectiveCamera(eye=(14, -40, 30), target=(15, 9, 8), field_of_view=32)
    return camera, [(sphere(RADIUS), np.eye(4)), (GLOBE, moved(19.0, 9.5, 10.0))]


def ellipsoids():
    """Pairs of an isosurface and a mesh next to each other: mirrored, sheared, stretched, rotated, or unchanged."""
    surface, objects = sphere(RADIUS), []
    maps = [((1, 1, 1), 0, 0), ((0.6, 1.2, 1), 1, 0), ((-1, 1, 0.8), 2, 0.5), ((0.5, 0.5, 1.4), 3, -0.4)]
    for number, (scale, angle, shear) in enumerate(maps):
        center = np.array((17.0 * (number % 2), 20.0 * (number // 2), 9.0))
        objects.append((surface, placed(scale, angle, shear, center, CENTER)))
        objects.append((GLOBE, placed(scale[::-1], -angle, -shear, center + (6.0, -1.5, -0.5), np.zeros(3))))
    camera = isospline.PerspectiveCamera(eye=(-5, -50, 60), target=(9, 11, 5), field_of_view=38)
    return camera, objects


SCENES = {"two spheres": two_spheres, "ellipsoids": ellipsoids}


def scene_of(objects):
    scene = isospline.Scene([FLOOR])
    for shape, transform in objects:
        scene.add(shape, transform)
    return scene


def is_mesh(shape):
    return isinstance(shape, isospline.Mesh)


def local_rays(transform, rays):
    """Rays in an object's own space, where it is a sphere; t is the same."""
    inverse = np.linalg.inv(transform)
    return np.hstack([rays[:, :3] @ inverse[:3, :3].T + inverse[:3, 3], rays[:, 3:] @ inverse[:3, :3].T])


def bracket(objects, rays):
    """The smallest and the largest possible t of each object, two (objects + floor, rays) arrays."""
    with np.errstate(divide="ignore", invalid="ignore"):
        floor = -rays[:, 2] / rays[:, 5]
        beyond = np.abs(rays[:, :2] + floor[:, None] * rays[:, 3:5] - 10).max(axis=1) - 50
    least, largest = ([np.where((floor > 0) & (beyond < margin), floor, np.inf)] for margin in (1e-3, -1e-3))
    for shape, transform in objects:
        mine = local_rays(transform, rays)
        center = np.zeros(3) if is_mesh(shape) else CENTER
        inside = np.linalg.norm(mine[:, :3] - center, axis=1) < RADIUS + EXACT
        least.append(np.where(inside, 0, sphere_t(mine, center, RADIUS + EXACT)))
        largest.append(sphere_t(mine, center, RADIUS - (SAGITTA if is_mesh(shape) else 0) - EXACT))
    return np.array(least), np.array(largest)


def expected_ids(objects, rays):
    """The geometry ids that rays find first, and whether the bracket decides them."""
    least, largest = bracket(objects, rays)
    first = largest.argmin(axis=0)
    rest = least.copy()
    np.put_along_axis(rest, first[None], np.inf, axis=0)
    hit = np.isfinite(np.take_along_axis(largest, first[None], 0)[0])
    missed = np.isinf(least).all(axis=0)
    decided = np.where(hit, np.take_along_axis(largest, first[None], 0)[0] < rest.min(axis=0), missed)
    return np.where(hit, first, isospline.INVALID_ID), decided


def outward_normals(objects, ids, primitives, positions):
    """Exact normals at positions: of the floor, of ellipsoids, and of faces."""
    normals = np.tile((0.0, 0.0, 1.0), (len(ids), 1))
    for number, (shape, transform) in enumerate(objects, start=1):
        mine = ids == number
        inverse = np.linalg.inv(transform)
        if is_mesh(shape):
            a, b, c = np.moveaxis(shape.vertices[shape.faces[primitives[mine]]], 1, 0)
            local = np.cross(b - a, c - a)
        else:
            local = positions[mine] @ inverse[:3, :3].T + inverse[:3, 3] - CENTER
        normals[mine] = local @ inverse[:3, :3]
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def expected_occlusions(objects, ids, rays, t_far):
    """Whether rays that leave objects are occluded before t_far, and whether the bracket decides it."""
    least, largest = bracket(objects, rays)
    for t in least, largest:  # a convex object does not occlude rays that leave its own surface
        np.put_along_axis(t, ids[None].astype(int), np.inf, axis=0)
    hidden = (largest < t_far).any(axis=0)
    perhaps = (least < t_far + 1e-6).any(axis=0)
    return hidden, hidden == perhaps


def expected_light(scene, objects, rays, hits, normals):
    """Diffuse light of LIGHTS with the shadows of the closed form, and whether the bracket decides it."""
    positions = rays[:, :3] + hits["t_hit"][:, None] * rays[:, 3:]
    light, decided = np.zeros(len(rays)), np.ones(len(rays), bool)
    for lamp in LIGHTS:
        positional = isinstance(lamp, isospline.PositionalLight)
        to_light = np.asarray(lamp.position) - positions if positional else -lamp.direction + 0 * positions
        facing = (normals * to_light).sum(axis=1) / np.linalg.norm(to_light, axis=1)
        # Shadow rays start off the surface by the rounding of double precision.
        shadow_rays = scene.secondary_rays(rays, hits, to_light)
        assert np.linalg.norm(shadow_rays[:, :3] - positions, axis=1).max() < 1e-8
        end = 1.0 if positional else np.inf
        hidden, sure = expected_occlusions(objects, hits["geometry_ids"], shadow_rays, end)
        decided &= (facing < 0) | ((facing > 1e-6) & sure)
        light += np.where((facing > 0) & ~hidden, lamp.intensity[0] * facing, 0)
    return light, decided


@pytest.mark.parametrize("make", SCENES.values(), ids=SCENES)
def test_a_picture_is_the_closed_form(make):
    """All pixels are right, except BUDGET pixels at silhouettes and cuts, and BUDGET pixels at shadows."""
    camera, objects = make()
    scene = scene_of(objects)
    image = render(scene, camera, size=SIZE, light=MATTE)
    rays = camera.rays(SIZE).reshape(-1, 6)
    hits = scene.cast_rays(rays, outputs=ALL_OUTPUTS)

    # The visible object, and its distance.
    ids, decided = expected_ids(objects, rays)
    shown = image.geometry_ids.reshape(-1)
    assert (~decided).sum() <= BUDGET
    np.testing.assert_array_equal(shown[decided], ids[decided])
    assert all((ids == number).sum() > 200 for number in range(len(objects) + 1))
    seen = decided & (shown != isospline.INVALID_ID)
    least, largest = (np.take_along_axis(t[:, seen], ids[None, seen], 0)[0] for t in bracket(objects, rays))
    t, length = hits["t_hit"], np.linalg.norm(rays[:, 3:], axis=1)
    assert (t[seen] * length[seen] > least * length[seen] - 1e-5).all()
    assert (t[seen] * length[seen] < largest * length[seen] + 1e-5).all()

    # Positions, depths and normals of the picture, from the values of t that were just checked.
    positions = rays[seen, :3] + t[seen, None] * rays[seen, 3:]
    np.testing.assert_allclose(image.position.reshape(-1, 3)[seen], positions, rtol=1e-6, atol=1e-5)
    depth = (np.hstack([positions, np.ones((len(positions), 1))]) @ camera.world_to_camera.T)[:, 2]
    np.testing.assert_allclose(image.depth.reshape(-1)[seen], depth, rtol=1e-6)
    normals = outward_normals(objects, shown[seen], image.primitive_ids.reshape(-1)[seen], positions)
    np.testing.assert_allclose(image.normal.reshape(-1, 3)[seen], normals, atol=2e-6)

    # Light and shadow.
    seen_hits = {name: values[seen] for name, values in hits.items()}
    light, sure = expected_light(scene, objects, rays[seen], seen_hits, normals)
    assert (~sure).sum() <= BUDGET
    color = image.color.reshape(-1, 4)[seen]
    np.testing.assert_allclose(color[sure, 0], 0.125 + 0.75 * light[sure], atol=1e-5)
    unshadowed = isospline.Phong(ambient=0.125, diffuse=0.75, specular=0, lights=LIGHTS)
    plain = render(scene, camera, size=SIZE, light=unshadowed).color.reshape(-1, 4)[seen]
    darker = shown[seen][sure & (color[:, 0] < plain[:, 0] - 0.01)]
    for kind in ("floor", isospline.Isosurface, isospline.Mesh):  # each is in the shadow of another
        kinds = ["floor", *(type(shape) for shape, _ in objects)]
        assert np.isin(darker, [number for number, own in enumerate(kinds) if own == kind]).sum() > 50


@pytest.mark.parametrize("make", SCENES.values(), ids=SCENES)
def test_secondary_rays_are_occluded_as_the_closed_form_says(make, rng):
    """Rays from visible points towards random points; the budget is 2 rays in 1000."""
    camera, objects = make()
    scene = scene_of(objects)
    rays = camera.rays(SIZE).reshape(-1, 6)
    hits = scene.cast_rays(rays)
    hit = np.isfinite(hits["t_hit"])
    for coherent in (False, True):
        np.testing.assert_array_equal(scene.test_occlusions(rays, coherent=coherent), hit)
    rays, hits = rays[hit], {name: values[hit] for name, values in hits.items()}
    positions = rays[:, :3] + hits["t_hit"][:, None] * rays[:, 3:]
    directions = rng.uniform((-20, -20, 3), (40, 40, 20), size=positions.shape) - positions
    facing = (directions * hits["primitive_normals"]).sum(axis=1) / np.linalg.norm(directions, axis=1)
    away = scene.secondary_rays(rays, hits, directions)
    hidden, decided = expected_occlusions(objects, hits["geometry_ids"], away, 1.0)
    sure = decided & (facing > 1e-6)
    assert (facing > 0).sum() - sure.sum() < 2e-3 * len(sure)
    np.testing.assert_array_equal(scene.test_occlusions(away, t_far=1.0)[sure], hidden[sure])
    assert min(hidden[sure].sum(), (~hidden[sure]).sum()) > 1000


LAYERS = [
    "color",
    "depth",
    "position",
    "normal",
    "albedo",
    "gradient_magnitude",
    "curvature",
    "variance",
    "geometry_ids",
    "primitive_ids",
]


def bytes_of(image):
    """All data of an image."""
    return {name: getattr(image, name).tobytes() for name in LAYERS if hasattr(image, name)}


RENDERINGS = {
    "shadows": {"light": MATTE, "layers": ("curvature",), "samples": 2},
    "ambient occlusion": {"light": isospline.AmbientOcclusion(4)},
    "path tracing": {"light": isospline.PathTracer(), "samples": 3},
}


@pytest.mark.parametrize("options", RENDERINGS.values(), ids=RENDERINGS)
def test_threads_do_not_change_a_bit_of_the_picture(options):
    camera, objects = ellipsoids()
    scene, pictures = scene_of(objects), []
    try:
        for threads in range(1, 9):
            isospline.set_thread_count(threads)
            pictures.append(bytes_of(render(scene, camera, size=(101, 75), **options)))
    finally:
        isospline.set_thread_count(0)
    assert len(pictures[0]) >= 8
    assert all(picture == pictures[0] for picture in pictures)


def test_single_rays_and_packets_are_the_picture():
    camera, objects = ellipsoids()
    scene = scene_of(objects)
    image = render(scene, camera, size=SIZE)
    rays = camera.rays(SIZE)
    single = scene.cast_rays(rays, outputs=ALL_OUTPUTS)
    try:
        for threads in range(1, 9):
            isospline.set_thread_count(threads)
            for coherent in (False, True):
                hits = scene.cast_rays(rays, outputs=ALL_OUTPUTS, coherent=coherent)
                for name in single:
                    np.testing.assert_array_equal(hits[name], single[name], err_msg=name)
    finally:
        isospline.set_thread_count(0)
    assert {*range(len(objects) + 1)} <= {*np.unique(single["geometry_ids"])}
    for name in ("geometry_ids", "primitive_ids"):
        np.testing.assert_array_equal(getattr(image, name), single[name])
    hit = np.isfinite(single["t_hit"])
    np.testing.assert_array_equal(image.normal[hit], single["primitive_normals"][hit].astype(np.float32))
    np.testing.assert_array_equal(image.position[hit], single["positions"][hit].astype(np.float32))
    np.testing.assert_array_equal(image.gradient_magnitude[hit], single["gradient_magnitudes"][hit].astype(np.float32))


@pytest.mark.slow
def test_a_hit_does_not_depend_on_what_is_found_behind_it():
    """Single rays and packets meet a mesh close behind an isosurface in different orders."""
    camera, objects = ellipsoids()
    scene = scene_of(objects)
    rays = camera.rays((400, 300))
    single, packets = (scene.cast_rays(rays, outputs=ALL_OUTPUTS, coherent=coherent) for coherent in (False, True))
    of_surfaces = single["geometry_ids"] % 2 == 1  # INVALID_ID is odd, too
    assert of_surfaces.mean() > 0.05
    for name in single:
        np.testing.assert_array_equal(packets[name][of_surfaces], single[name][of_surfaces], err_msg=name)


def test_instances_are_copies():
    """A scene of instances gives the same results as one of separate objects, bit for bit."""
    camera, objects = ellipsoids()
    copies = [
        (isospline.Mesh(shape.vertices, shape.faces) if is_mesh(shape) else sphere(RADIUS), transform)
        for shape, transform in objects
    ]
    scenes = [scene_of(objects), scene_of(copies)]
    pictures = [bytes_of(render(scene, camera, size=(101, 75), light=MATTE)) for scene in scenes]
    assert pictures[0] == pictures[1]
    assert [scene.build_count for scene in scenes] == [3, 9]
