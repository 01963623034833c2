"""Objects of a scene: added, moved, hidden and removed, alone and as instances, from one thread and from several."""

import gc
import threading
from copy import copy

import numpy as np
import pytest
from hit_outputs import ALL_OUTPUTS
from layered import render
from spheres import CENTER, mesh_sphere, moved, sphere, sphere_t

import isospline

DOWN = np.array([(0.2, 0.2, 10.0, 0.0, 0.0, -1.0)])


def triangle():
    return isospline.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])


def rays_at(rng, center, radius, count, distance=60.0):
    origins = rng.normal(size=(count, 3))
    origins *= distance / np.linalg.norm(origins, axis=1, keepdims=True)
    targets = radius * rng.uniform(-1, 1, size=(count, 3))
    return np.hstack([center + origins, targets - origins])


def assert_same_hits(actual, expected):
    assert actual.keys() == expected.keys()
    for name in expected:
        np.testing.assert_array_equal(actual[name], expected[name], err_msg=name)


# Adding, moving, removing


def test_ids_are_never_used_again():
    scene = isospline.Scene([triangle(), triangle()])
    assert (scene.ids, len(scene), list(scene)) == ([0, 1], 2, [0, 1])
    scene.remove(0)
    assert (scene.ids, len(scene), 0 in scene, 1 in scene, "1" in scene) == ([1], 1, False, True, False)
    assert scene.add(triangle()) == 2
    scene.remove(1)
    scene.remove(np.uint32(2))
    assert (scene.ids, len(scene)) == ([], 0)
    assert np.isinf(scene.cast_rays(DOWN)["t_hit"][0])
    assert scene.add(triangle()) == 3
    assert scene.cast_rays(DOWN)["geometry_ids"][0] == 3


def test_objects_are_given_in_a_list_or_one_by_one():
    surface, mesh, place = sphere(), triangle(), moved(1, 2, 3)
    for scene in (
        isospline.Scene(surface, (mesh, place), build_quality="low"),
        isospline.Scene([surface, (mesh, place)], build_quality="low"),
    ):
        assert scene.object(0) is surface and scene.object(1) is mesh and scene.build_quality == "low"
        np.testing.assert_array_equal(scene.transform(1), place)


def test_objects_are_the_ones_that_were_added():
    surface, mesh = sphere(), triangle()
    scene = isospline.Scene([surface])
    scene.add(mesh, moved(1, 2, 3))
    assert scene.object(0) is surface and scene.object(1) is mesh
    np.testing.assert_array_equal(scene.transform(0), np.eye(4))
    np.testing.assert_array_equal(scene.transform(1), moved(1, 2, 3))


@pytest.mark.parametrize("query", ["single", "packets", "all", "occlusion"])
def test_transforms_take_effect_at_the_next_query(rng, query):
    """A changed scene gives the same answers as a new one in that state."""
    surface, mesh = sphere(), mesh_sphere(6.0, 32)
    matrix = np.array([[0.0, -2.0, 0.0, 20.0], [1.5, 0.0, 0.5, -4.0], [0.0, 0.3, 1.0, 1.0], [0.0, 0.0, 0.0, 1.0]])
    changed = isospline.Scene([surface, surface, mesh])
    rays = rays_at(rng, CENTER, 20.0, 3000)
    ask = {
        "single": lambda rays: changed.cast_rays(rays, coherent=False),
        "packets": lambda rays: changed.cast_rays(rays, coherent=True),
        "all": changed.list_intersections,
        "occlusion": lambda rays: {"": changed.test_occlusions(rays)},
    }[query]
    before = ask(rays)
    changed.set_transform(0, matrix)
    changed.set_transform(2, moved(14, 11, 12))
    changed.remove(1)
    changed.set_transform(0, transform=matrix @ moved(0.25, 0.5, 0.75))
    np.testing.assert_array_equal(changed.transform(0), matrix @ moved(0.25, 0.5, 0.75))

    made = isospline.Scene()
    made.add(surface, matrix @ moved(0.25, 0.5, 0.75))
    made.remove(made.add(mesh))
    made.add(mesh, moved(14, 11, 12))
    expected = {
        "single": made.cast_rays,
        "packets": made.cast_rays,
        "all": made.list_intersections,
        "occlusion": lambda rays: {"": made.test_occlusions(rays)},
    }[query](rays)
    actual = ask(rays)
    assert_same_hits(actual, expected)
    assert any(before[name].shape != actual[name].shape or (before[name] != actual[name]).any() for name in actual)
    np.testing.assert_array_equal(changed.bounds, made.bounds)


def test_only_shapes_that_change_are_built():
    surface, mesh = sphere(), mesh_sphere(3.0, 32)
    scene = isospline.Scene([surface, mesh])
    assert scene.build_count == 2
    for x in range(20):
        scene.set_transform(1, moved(x, 2 * x, -x))
        assert scene.build_count == 2
    scene.add(mesh, moved(5, 5, 5))
    scene.set_visibility(0, visible=False)
    scene.remove(1)
    assert scene.build_count == 2
    surface.level = 49.0
    assert scene.build_count == 3
    scene.add(triangle())
    assert scene.build_count == 4


@pytest.mark.slow
def test_boxes_cover_the_instance_that_needs_the_widest(rng):
    """Instances far from each other and of very different sizes: single precision rounds most in the smallest."""
    surface = sphere()
    scene = isospline.Scene()
    scales, offsets = np.array([1e-4, 1.0, 300.0]), np.array([(0, 0, 0), (5e3, 1, 2), (-2e4, 7e3, 0)])
    for scale, offset in zip(scales, offsets):
        matrix = np.diag([scale, scale, scale, 1.0])
        matrix[:3, 3] = offset
        scene.add(surface, matrix)
    for geometry_id, (scale, offset) in enumerate(zip(scales, offsets)):
        center = offset + scale * CENTER
        rays = rays_at(rng, center, 7.9 * scale / np.sqrt(3), 5000, 12 * scale)  # all of them hit
        for coherent in (False, True):
            hits = scene.cast_rays(rays, coherent=coherent, outputs=ALL_OUTPUTS)
            assert (hits["geometry_ids"] == geometry_id).all()
            radius = np.linalg.norm(hits["positions"] - center, axis=1)
            np.testing.assert_allclose(radius, 8 * scale, rtol=1e-6, atol=1e-15 * np.abs(offset).max())


# Instances


def test_a_hundred_instances_take_the_memory_of_one(rng):
    samples = rng.normal(size=(24, 24, 24))
    rays = np.concatenate([rng.uniform(0, 23, (20000, 3)), rng.normal(size=(20000, 3))], axis=1)

    def memory(scene):
        scene.count_intersections(rays)  # through all bricks: they are made when rays enter them
        return scene.memory

    for shape in (isospline.Isosurface(isospline.Volume(samples), 0.2), mesh_sphere(8.0)):
        scene = isospline.Scene([shape])
        one = memory(scene)
        for i in range(1, 100):
            scene.add(shape, moved(30 * i, 0, 0))
        # Transforms and ids of an instance, and its share of Embree's hierarchy over all of them: 560 to 800 bytes with
        # Embree 3.13, 1020 with 4.3.
        assert memory(scene) < one + 99 * 1100
        copies = isospline.Scene([shape, type(shape)(*shape_arguments(shape))])
        assert memory(copies) > 1.8 * one


def shape_arguments(shape):
    return (shape.vertices, shape.faces) if isinstance(shape, isospline.Mesh) else (shape.volume, shape.level)


def test_each_instance_is_met_where_it_is(rng):
    """A lattice of rotated, scaled and mirrored spheres and meshes against closed forms."""
    surface, mesh = sphere(), mesh_sphere(8.0)
    scene = isospline.Scene()
    centers, radii = [], []
    for i in range(30):
        rotation, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        scale = rng.uniform(0.5, 1.5)
        center = 30.0 * np.array([i % 5, i // 5 % 3, i // 15])
        matrix = np.eye(4)
        matrix[:3, :3] = scale * rotation
        matrix[:3, 3] = center - matrix[:3, :3] @ (CENTER if i % 2 else np.zeros(3))
        assert scene.add(surface if i % 2 else mesh, matrix) == i
        centers.append(center)
        radii.append(8 * scale)
    assert scene.build_count <= 2
    rays = rays_at(rng, np.array([60.0, 30.0, 15.0]), 70.0, 20000, 300.0)
    all_t = np.stack([sphere_t(rays, center, radius) for center, radius in zip(centers, radii)])
    t, nearest = all_t.min(axis=0), all_t.argmin(axis=0)
    hits = scene.cast_rays(rays)
    offset = np.asarray(centers)[:, None] - rays[:, :3]
    length = np.linalg.norm(rays[:, 3:], axis=1)
    distance = np.linalg.norm(np.cross(offset, rays[:, 3:]), axis=-1) / length
    clear = (np.abs(distance - np.asarray(radii)[:, None]) > 0.05).all(axis=0)  # of silhouettes, which meshes coarsen
    assert clear.mean() > 0.8
    np.testing.assert_array_equal(np.isfinite(hits["t_hit"])[clear], np.isfinite(t)[clear])
    hit = clear & np.isfinite(t)
    np.testing.assert_array_equal(hits["geometry_ids"][hit], nearest[hit])
    exact = hit & (nearest % 2 == 1)
    assert (np.abs(hits["t_hit"][exact] - t[exact]) * length[exact]).max() < 1e-6
    for coherent in (False, True):
        assert_same_hits(scene.cast_rays(rays, coherent=coherent), hits)


# Visibility


@pytest.mark.parametrize("kind", ["isosurface", "mesh"])
def test_visibility(kind):
    shape = sphere() if kind == "isosurface" else mesh_sphere(8.0, 64)
    at = np.zeros(3) if kind == "isosurface" else CENTER
    scene = isospline.Scene()
    front = scene.add(shape, moved(*at), visible=False)
    back = scene.add(shape, moved(*(at + (40, 0, 0))), casts_shadow=False)
    assert scene.visibility(front) == {"visible": False, "casts_shadow": True}
    ray = [(-20, 11.4, 11.3, 1, 0, 0)]

    def seen():
        singles, packets = (scene.cast_rays(ray, coherent=coherent) for coherent in (False, True))
        assert_same_hits(packets, singles)
        crossings = scene.list_intersections(ray)["geometry_ids"].tolist()
        assert crossings[:1] == [geometry for geometry in singles["geometry_ids"].tolist() if geometry in scene]
        assert scene.count_intersections(ray)[0] == len(crossings)
        in_front, behind = ({"t_near": t, "t_far": t + 50} for t in (0, 50))
        return sorted(set(crossings)), [bool(scene.test_occlusions(ray, **limits)[0]) for limits in (in_front, behind)]

    assert seen() == ([back], [True, False])
    scene.set_visibility(front, visible=True)
    assert scene.visibility(front) == {"visible": True, "casts_shadow": True}
    assert seen() == ([front, back], [True, False])
    scene.set_visibility(front, casts_shadow=False)
    assert seen() == ([front, back], [False, False])
    scene.set_visibility(back, visible=False, casts_shadow=True)
    assert seen() == ([front], [False, True])
    for geometry in scene:
        scene.set_visibility(geometry, visible=False, casts_shadow=False)
    assert seen() == ([], [False, False])
    for geometry in scene:
        scene.set_visibility(geometry, visible=True, casts_shadow=True)
    assert seen() == ([front, back], [True, True])


def test_what_is_hidden_is_not_in_pictures():
    scene = isospline.Scene([sphere(), sphere()])
    scene.set_transform(1, moved(5, 0, 0))
    camera = isospline.camera_for(scene)
    scene.set_visibility(1, visible=False)
    hidden = render(scene, camera, size=(64, 48))
    assert set(np.unique(hidden.geometry_ids)) == {0, isospline.INVALID_ID}
    scene.remove(1)
    removed = render(scene, camera, size=(64, 48))
    np.testing.assert_array_equal(hidden.color, removed.color)
    scene.add(sphere(), moved(5, 0, 0))  # id 2, of two objects
    assert set(np.unique(render(scene, camera, size=(64, 48)).geometry_ids)) == {0, 2, isospline.INVALID_ID}


# Details


def test_details_of_hits(rng):
    surface, mesh = sphere(), isospline.Mesh([(0, 0, 30), (24, 0, 30), (0, 24, 31)], [(0, 1, 2)])
    scene = isospline.Scene([surface, mesh])
    rays = rays_at(rng, CENTER, 14.0, 4000).reshape(40, 100, 6)
    plain, hits = scene.cast_rays(rays), scene.cast_rays(rays, outputs=ALL_OUTPUTS)
    for name in plain:
        np.testing.assert_array_equal(hits[name], plain[name])
    assert {name: (hits[name].shape, hits[name].dtype) for name in hits.keys() - plain.keys()} == {
        "positions": ((40, 100, 3), np.float64),
        "primitive_uvs": ((40, 100, 2), np.float32),
        "gradient_magnitudes": ((40, 100), np.float64),
        "grazing": ((40, 100), np.bool_),
        "dt_dlevel": ((40, 100), np.float64),
        "dt_dorigin": ((40, 100, 3), np.float64),
        "dt_ddirection": ((40, 100, 3), np.float64),
        "dnormal_dlevel": ((40, 100, 3), np.float64),
        "dnormal_dorigin": ((40, 100, 3, 3), np.float64),
        "dnormal_ddirection": ((40, 100, 3, 3), np.float64),
        "coefficient_indices": ((40, 100, 27), np.int64),
        "coefficient_weights": ((40, 100, 27), np.float64),
        "coefficient_gradients": ((40, 100, 27, 3), np.float64),
    }
    for coherent in (False, True):
        assert_same_hits(scene.cast_rays(rays, outputs=ALL_OUTPUTS, coherent=coherent), hits)

    on_surface, on_mesh = hits["geometry_ids"] == 0, hits["geometry_ids"] == 1
    assert on_surface.sum() > 500 and on_mesh.sum() > 100
    points = rays[..., :3] + hits["t_hit"][..., None] * rays[..., 3:]
    hit = on_surface | on_mesh
    np.testing.assert_allclose(hits["positions"][hit], points[hit], rtol=1e-14, atol=1e-12)
    assert np.isnan(hits["positions"][~hit]).all()
    gradient = surface.volume.sample(points[on_surface], derivative=1)
    np.testing.assert_allclose(hits["gradient_magnitudes"][on_surface], np.linalg.norm(gradient, axis=1), rtol=1e-9)
    assert (hits["gradient_magnitudes"][~on_surface] == 0).all()
    u, v = np.moveaxis(hits["primitive_uvs"][on_mesh].astype(float), -1, 0)
    corners = mesh.vertices
    between = (1 - u - v)[:, None] * corners[0] + u[:, None] * corners[1] + v[:, None] * corners[2]
    np.testing.assert_allclose(between, points[on_mesh], atol=1e-4)
    assert (hits["primitive_uvs"][~on_mesh] == 0).all()


# Bad input, removed objects, and threads


@pytest.mark.parametrize(
    "call",
    [
        lambda scene, geometry_id: scene.remove(geometry_id),
        lambda scene, geometry_id: scene.set_transform(geometry_id, np.eye(4)),
        lambda scene, geometry_id: scene.set_visibility(geometry_id, visible=True),
        lambda scene, geometry_id: scene.transform(geometry_id),
        lambda scene, geometry_id: scene.visibility(geometry_id),
        lambda scene, geometry_id: scene.object(geometry_id),
    ],
)
def test_bad_ids(call):
    scene = isospline.Scene([triangle(), triangle()])
    scene.remove(0)
    expected = "geometry_id: expected the geometry id of an object in the scene, got "
    for bad, got in [
        (0, "0, which has been removed"),
        (2, "2"),
        (-1, "-1"),
        (2**32 + 1, "4294967297"),
        (isospline.INVALID_ID, "4294967295"),
        (10**30, "1" + 30 * "0"),
    ]:
        with pytest.raises(ValueError, match=f"^{expected}{got}$"):
            call(scene, bad)
    with pytest.raises(TypeError, match="geometry_id: expected an int"):
        call(scene, 1.0)
    assert scene.ids == [1]


def test_removed_ids_in_hits_and_shading():
    scene = isospline.Scene([triangle()])
    hits = scene.cast_rays(DOWN)
    scene.remove(0)
    with pytest.raises(ValueError, match="hit: expected the geometry id .* got 0, which has been removed"):
        scene.secondary_rays(DOWN, hits, [(0, 0, 1)])
    scene.add(triangle())
    camera = isospline.camera_for(scene)
    with pytest.raises(ValueError, match="light: expected geometry ids of objects in the scene"):
        render(scene, camera, size=(8, 8), light={0: isospline.Phong()})


@pytest.mark.parametrize(
    "matrix, message",
    [
        (np.diag([1.0, 0.0, 1.0, 1.0]), "transform: expected an invertible map"),
        (np.ones((4, 4)), "transform: expected an affine map"),
        (np.full((4, 4), np.inf), "transform: expected finite numbers"),
        (np.eye(3), r"transform: expected shape \(4, 4\)"),
    ],
)
def test_a_bad_transform_changes_nothing(matrix, message):
    scene = isospline.Scene([triangle()])
    with pytest.raises(ValueError, match=message):
        scene.set_transform(0, matrix)
    with pytest.raises(ValueError, match=message):
        scene.add(triangle(), matrix)
    np.testing.assert_array_equal(scene.transform(0), np.eye(4))
    assert scene.ids == [0] and scene.cast_rays(DOWN)["t_hit"][0] == 10.0


def test_degenerate_triangles_are_never_hit():
    vertices = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (2, 0, 0)]
    scene = isospline.Scene([isospline.Mesh(vertices, [(0, 1, 3), (0, 0, 2), (1, 1, 1), (0, 1, 2)])])
    for coherent in (False, True):
        hits = scene.cast_rays(
            [(0.2, 0.2, 1, 0, 0, -1), (0.5, 0.0, 1, 0, 0, -1), (1.5, 0, 1, 0, 0, -1)], coherent=coherent
        )
        assert hits["primitive_ids"][0] == 3 and hits["primitive_ids"][1] in (3, isospline.INVALID_PRIMITIVE_ID)
        assert np.isinf(hits["t_hit"][2])
    assert np.isfinite(hits["primitive_normals"]).all()
    only_points = isospline.Scene([isospline.Mesh(vertices, [(0, 0, 0)])])
    assert np.isinf(only_points.cast_rays([(0, 0, 1, 0, 0, -1)])["t_hit"][0])


def test_objects_live_as_long_as_the_scene_needs_them():
    surface, mesh = sphere(), triangle()
    scene = isospline.Scene([surface])
    scene.add(mesh, moved(0, 0, 30))
    rays = [(11.4, 11.3, 60, 0, 0, -1), (0.2, 0.2, 60, 0, 0, -1)]
    expected = scene.cast_rays(rays)
    del surface, mesh
    gc.collect()
    assert_same_hits(scene.cast_rays(rays), expected)
    assert isinstance(scene.object(0), isospline.Isosurface) and len(scene.object(1).faces) == 1
    scene.object(0).level = 49.0
    assert scene.cast_rays(rays)["t_hit"][0] > expected["t_hit"][0]


def interpenetrating():
    """An isosurface sphere and a mesh sphere that cut into each other, and the camera's rays at them."""
    scene = isospline.Scene([sphere(6.0)])
    scene.add(mesh_sphere(6.0, 512), moved(16.0, 12.5, 10.5))
    camera = isospline.PerspectiveCamera(eye=(14, -40, 20), target=(14, 11.5, 11.5), field_of_view=25)
    return scene, camera.rays((320, 240))


def test_threads_query_one_scene(rng):
    scene, rays = interpenetrating()
    expected = scene.cast_rays(rays)
    fresh, _ = interpenetrating()  # not committed: all threads try to commit it
    results = [None] * 6

    def query(i):
        results[i] = [fresh.cast_rays(rays, coherent=i % 2 == 0) for _ in range(3)]

    threads = [threading.Thread(target=query, args=(i,)) for i in range(len(results))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for result in results:
        for hits in result:
            assert_same_hits(hits, expected)
    assert fresh.build_count == 2


def test_threads_change_a_scene_that_others_query():
    """Every answer belongs to the scene before or after a change, never to a state in between."""
    surface, mesh = sphere(), mesh_sphere(6.0, 64)
    scene = isospline.Scene([surface])
    rays = np.tile([(11.4, 11.3, 60.0, 0.0, 0.0, -1.0)], (5000, 1))
    below, above = scene.cast_rays(rays)["t_hit"][0], None
    probe = isospline.Scene()
    probe.add(mesh, moved(11.5, 11.5, 40))
    above = probe.cast_rays(rays)["t_hit"][0]
    errors, answers, stop = [], set(), threading.Event()

    def query():
        try:
            while not stop.is_set():
                found = np.unique(np.round(scene.cast_rays(rays)["t_hit"], 3))
                assert len(found) == 1
                answers.add(float(found[0]))
        except BaseException as error:
            errors.append(error)

    threads = [threading.Thread(target=query) for _ in range(3)]
    for thread in threads:
        thread.start()
    for _ in range(100):
        added = scene.add(mesh, moved(11.5, 11.5, 40))
        scene.cast_rays(rays[:1])
        scene.remove(added)
        scene.cast_rays(rays[:1])
    stop.set()
    for thread in threads:
        thread.join()
    assert not errors
    assert answers <= {round(float(below), 3), round(float(above), 3)} and answers


def test_a_copy_has_what_the_scene_has_built():
    field = isospline.volumes.torus()
    scene = isospline.Scene([isospline.Isosurface(field.volume(24), field.level)])
    scene.settle()
    copied = copy(scene)
    assert copied.cast_rays([[0, 0, 9, 0.5, 0, -9]]).t_hit.shape == (1,)
    assert copied.is_settled and copied.build_count == 0


def test_a_picture_of_many_rays_settles_first():
    field = isospline.volumes.torus()
    scene = isospline.Scene([isospline.Isosurface(field.volume(24), field.level)])
    isospline.render(scene, size=(16, 12), light="phong")
    assert not scene.is_settled
    isospline.render(scene, size=(16, 12), samples=1024, light="phong")
    assert scene.is_settled


def test_a_picture_in_a_studio_settles_first():
    field = isospline.volumes.torus()
    scene = isospline.Scene([isospline.Isosurface(field.volume(24), field.level)])
    isospline.render(scene, size=(8, 6))
    assert not scene.is_settled
    isospline.render(scene, size=(48, 36))
    assert scene.is_settled


def test_a_path_traced_picture_settles_first_or_between_its_steps():
    field = isospline.volumes.torus()
    scene, other = (isospline.Scene([isospline.Isosurface(field.volume(24), field.level)]) for _ in range(2))
    options = {"camera": isospline.camera_for(scene), "size": (16, 12), "light": isospline.PathTracer()}
    renderer = isospline.ProgressiveRenderer(scene, **options)
    renderer.step(2)
    assert not scene.is_settled
    scene.settle()
    renderer.step(254)
    assert not other.is_settled
    picture = isospline.render(other, samples=256, **options)
    assert other.is_settled
    np.testing.assert_array_equal(renderer.image.color, picture.color)
