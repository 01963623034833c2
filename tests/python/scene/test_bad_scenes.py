"""Invalid input to scenes, and removed objects: a clear error, or a valid answer.

test_scene_objects.py has more tests of removed objects.
"""

import gc

import numpy as np
import pytest
from hit_outputs import ALL_OUTPUTS
from layered import render
from spheres import CENTER, moved, sphere

import isospline

TRIANGLE = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0)], float)
DOWN = np.array([(0.2, 0.2, 10.0, 0.0, 0.0, -1.0)])


def triangle(scale=1.0):
    return isospline.Mesh(scale * TRIANGLE, [(0, 1, 2)])


# Data of meshes


@pytest.mark.parametrize(
    "arguments, error, message",
    [
        ({"vertices": TRIANGLE + (0, np.inf, 0)}, ValueError, "vertices: expected finite numbers, got inf in vertex 0"),
        ({"vertices": [*TRIANGLE[:2], (0, -np.inf, 0)]}, ValueError, "vertices: expected .*, got -inf in vertex 2"),
        ({"vertices": np.zeros((3, 2))}, ValueError, r"vertices: expected shape .*3\), got \(3, 2\)"),
        ({"vertices": np.zeros((2, 3, 3))}, ValueError, r"vertices: expected shape \(V, 3\), got 3 dimensions"),
        ({"vertices": np.zeros((3, 3), complex)}, TypeError, "vertices: expected an array of real numbers"),
        ({"faces": [(0, 1, 2.0)]}, TypeError, "faces: expected an array of integers, got .* and type float64"),
        ({"faces": np.ones((1, 3), bool)}, TypeError, "faces: expected an array of integers, got .* and type bool"),
        ({"faces": [0, 1, 2]}, ValueError, r"faces: expected shape \(F, 3\), got \(3,\)"),
        (
            {"faces": [(0, 1, 2), (0, 1, 2**32)]},
            ValueError,
            "faces: expected vertex indices .* got 4294967296 in face 1",
        ),
        (
            {"faces": np.array([(0, 1, 2**64 - 1)], np.uint64)},
            ValueError,
            "faces: expected vertex indices .* in face 0",
        ),
        ({"normals": np.ones((3, 2))}, ValueError, r"normals: expected shape .*3\), got \(3, 2\)"),
        ({"normals": np.ones((1, 3))}, ValueError, r"normals: expected shape \(3, 3\), as for vertices, got \(1, 3\)"),
        (
            {"normals": np.full((3, 3), np.nan)},
            ValueError,
            r"normals: expected finite numbers, got \(nan.* at vertex 0",
        ),
        ({"normals": "up"}, TypeError, "normals: expected an array of real numbers"),
        ({"colors": np.ones(3)}, ValueError, r"colors: expected shape \(V, 3\), got 1 dimensions"),
        ({"colors": np.ones((4, 3))}, ValueError, r"colors: expected shape \(3, 3\), as for vertices, got \(4, 3\)"),
        ({"colors": np.full((3, 3), np.inf)}, ValueError, r"colors: expected numbers from 0 to 1 .*, got \(inf"),
        ({"colors": np.full((3, 3), np.nan)}, ValueError, r"colors: expected finite numbers, got \(nan.* at vertex 0"),
        ({"colors": -np.ones((3, 3))}, ValueError, "colors: expected finite numbers of at least 0"),
    ],
)
def test_bad_meshes(arguments, error, message):
    with pytest.raises(error, match=f"^{message}"):
        isospline.Mesh(**{"vertices": TRIANGLE, "faces": [(0, 1, 2)], **arguments})


def test_a_mesh_without_faces_is_never_hit():
    for vertices in (np.zeros((0, 3)), TRIANGLE):
        scene = isospline.Scene([isospline.Mesh(vertices, np.zeros((0, 3), int))])
        assert np.isinf(scene.cast_rays(DOWN)["t_hit"][0]) and not scene.test_occlusions(DOWN)[0]
        assert scene.count_intersections(DOWN)[0] == 0
        scene.add(triangle())
        assert scene.cast_rays(DOWN)["geometry_ids"][0] == 1


# One good triangle among degenerate ones: lines, points, and a sliver with an area that rounds to zero.
DEGENERATE = np.array([(0, 1, 3), (0, 0, 2), (1, 1, 1), (0, 1, 2), (2, 4, 5)])
CORNERS = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (2, 0, 0), (0, 1 + 1e-300, 0), (1e-300, 1, 0)])
GOOD = 3


def rays_at_degenerate(rng):
    """Rays at the good triangle, along its plane, and at corners and edges of all faces."""
    faces = CORNERS[DEGENERATE]
    weights = rng.dirichlet((1, 1, 1), (300, len(faces)))
    weights[:100] = np.eye(3)[rng.integers(0, 3, (100, len(faces)))]
    targets = (weights[..., None] * faces).sum(axis=2).reshape(-1, 3)
    origins = rng.uniform((-2, -2, 1), (2, 2, 5), size=targets.shape)
    origins[::7, 2] = 0
    return np.hstack([origins, targets - origins])


def test_degenerate_triangles_show_nowhere(rng):
    mesh = isospline.Mesh(CORNERS, DEGENERATE)
    scene, plain = isospline.Scene([mesh]), isospline.Scene([isospline.Mesh(CORNERS, DEGENERATE[[GOOD]])])
    rays = rays_at_degenerate(rng)
    x, y, _ = (rays[:, :3] + rays[:, 3:]).T
    inside = np.minimum(np.minimum(x, y), 1 - x - y) > 1e-5
    clear = (rays[:, 2] > 0.1) & (inside | (x > 1 + 1e-5))  # at its edges, the good triangle may be hit or not
    for coherent in (False, True):
        hits = scene.cast_rays(rays, coherent=coherent, outputs=ALL_OUTPUTS)
        hit = np.isfinite(hits["t_hit"])
        np.testing.assert_array_equal(hit[clear], inside[clear])
        assert (hits["primitive_ids"][hit] == GOOD).all() and clear.sum() > 200 and inside.sum() > 100
        np.testing.assert_allclose(hits["t_hit"][hit], 1, rtol=1e-6)
        assert all(np.isfinite(values[hit]).all() for values in hits.values())
        np.testing.assert_array_equal(np.abs(hits["primitive_normals"][hit]), [(0, 0, 1)] * hit.sum())
    for coherent in (False, True):
        np.testing.assert_array_equal(scene.test_occlusions(rays, coherent=coherent)[clear], inside[clear])
    np.testing.assert_array_equal(scene.count_intersections(rays)[clear], inside[clear])
    crossings, expected = scene.list_intersections(rays[clear]), plain.list_intersections(rays[clear])
    assert (crossings["primitive_ids"] == GOOD).all()
    for name in ("ray_splits", "t_hit", "positions", "entering"):
        np.testing.assert_array_equal(crossings[name], expected[name])

    away = scene.secondary_rays(
        rays[hit], {name: values[hit] for name, values in hits.items()}, rng.normal(size=(hit.sum(), 3))
    )
    assert np.isfinite(away).all() and not scene.test_occlusions(away).any()
    triangles, index = isospline.RayMeshIntersector(mesh).intersects_id(rays[clear, :3], rays[clear, 3:])
    assert set(triangles) == {GOOD}
    np.testing.assert_array_equal(index, np.flatnonzero(inside[clear]))


def test_hits_on_degenerate_triangles_have_secondary_rays():
    """The hits name a degenerate triangle, although no query returns such hits."""
    scene = isospline.Scene([isospline.Mesh(CORNERS, DEGENERATE)])
    hits = scene.cast_rays(DOWN)
    for primitive in set(range(len(DEGENERATE))) - {GOOD}:
        hits["primitive_ids"][:] = primitive
        assert np.isfinite(scene.secondary_rays(DOWN, hits, [(0.1, 0.2, 1)])).all()


NORMALS = {
    "flat": None,
    "zero": np.zeros((6, 3)),
    "opposite": np.array([(0, 0, 1), (0, 0, -1), (0, 0, 1), (0, 0, 1), (0, 0, 1), (0, 0, 1)]),
    "huge": np.full((6, 3), 1e300),
}
SHADINGS = {
    "Phong": {"light": isospline.Phong(shadows=True)},
    "Outline": {"light": isospline.Outline()},
    "AmbientOcclusion": {"light": isospline.AmbientOcclusion(4)},
    "ColorByNormal": {"light": isospline.Phong(color=isospline.ColorByNormal()), "layers": ("curvature",)},
    "PathTracer": {"light": isospline.PathTracer(), "samples": 8},
}


@pytest.mark.parametrize("options", SHADINGS.values(), ids=SHADINGS)
@pytest.mark.parametrize("normals", NORMALS.values(), ids=NORMALS)
def test_no_picture_has_what_is_no_number(normals, options):
    scene = isospline.Scene([isospline.Mesh(CORNERS, DEGENERATE, normals=normals), sphere()])
    scene.set_transform(1, moved(*(-CENTER - (0, 0, 9))))
    camera = isospline.PerspectiveCamera((0.3, 0.2, 4), (0.3, 0.3, 0), up=(0, 1, 0), field_of_view=40)
    image = render(scene, camera, size=(48, 36), **options)
    seen = image.geometry_ids == 0
    assert seen.sum() > 50 and (image.primitive_ids[seen] == GOOD).all()
    assert np.isfinite(image.color).all() and image.color[seen][:, :3].max() > 0
    shown = image.geometry_ids != isospline.INVALID_ID
    for name in image.layers:
        assert np.isfinite(getattr(image, name)[shown]).all()
    np.testing.assert_allclose(np.linalg.norm(image.normal[shown], axis=-1), 1, rtol=1e-6)


# Transforms

LARGE = r"objects: expected all within a radius of 1e\+12 units of the world, got"
SMALL = "objects: expected voxels, and units of meshes, of at least 1e-12 in the world and .* diameter, got"


def with_entry(row, column, value):
    matrix = np.eye(4)
    matrix[row, column] = value
    return matrix


@pytest.mark.parametrize(
    "matrix, message",
    [
        (with_entry(3, 0, 1e-3), "transform: expected an affine map"),
        (with_entry(3, 3, 2.0), "transform: expected an affine map"),
        (with_entry(0, 3, np.nan), "transform: expected finite numbers"),
        (with_entry(1, 1, -0.0), "transform: expected an invertible map"),
        (
            np.array([[1, 1, 0, 0], [1, 1 + 1e-15, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]),
            "transform: expected an invertible map",
        ),
        (np.diag([1e-18, 1e-18, 1e-18, 1]), SMALL),
        (np.diag([1e30, 1e30, 1e30, 1]), LARGE),
        (np.diag([1e100, 1e100, 1e100, 1]), LARGE),
    ],
)
def test_a_refused_transform_changes_nothing(matrix, message):
    """Some sizes are too large for single precision: Embree would stop the process."""
    for shape in (triangle(), sphere()):
        scene = isospline.Scene([shape])
        before = scene.cast_rays(DOWN)
        with pytest.raises(ValueError, match=f"^{message}"):
            scene.set_transform(0, matrix)
        with pytest.raises(ValueError, match=f"^{message}"):
            scene.add(shape, matrix)
        assert (scene.ids, scene.add(shape)) == ([0], 1)
        for coherent in (False, True):
            np.testing.assert_array_equal(scene.cast_rays(DOWN, coherent=coherent)["t_hit"], before["t_hit"])


def volume_of(size):
    return isospline.Isosurface(isospline.Volume(np.mgrid[:5, :5, :5][2], spacing=(size,) * 3), 1.7)


@pytest.mark.parametrize(
    "item, message",
    [
        (triangle(1e15), rf"{LARGE} 7\.07107e\+14"),
        (volume_of(1e30), rf"{LARGE} 4\.33013e\+30"),
        (volume_of(1e-30), f"{SMALL} 1e-30 in a scene of diameter 8.66025e-30"),
        (volume_of(1e-60), f"{SMALL} 1e-60 in a scene"),  # the smallest
    ],
)
def test_objects_that_single_precision_cannot_hold(item, message):
    with pytest.raises(ValueError, match=f"^{message} .*for geometry id 0$"):
        isospline.Scene([item])


def test_objects_too_far_from_each_other_are_named_and_can_be_removed():
    scene = isospline.Scene([triangle()])
    scene.add(triangle(), moved(1e16, 0, 0))  # each one alone is valid
    for query in (scene.cast_rays, scene.test_occlusions, scene.count_intersections):
        with pytest.raises(ValueError, match=f"^{LARGE} 5e.15 for geometry id 0$"):
            query(DOWN)
    scene.remove(1)
    assert scene.cast_rays(DOWN)["t_hit"][0] == 10
    scene.add(triangle(), np.diag([1e-6, 1e-6, 1e-6, 1]))
    scene.add(triangle(), moved(1.5e6, 0, 0))
    with pytest.raises(ValueError, match=rf"^{SMALL} 1e-06 in a scene of diameter 1\.5e\+06 for geometry id 2$"):
        scene.cast_rays(DOWN)


@pytest.mark.parametrize("scale", [1e-11, 1e-6, 1e6, 1e10])
def test_sizes_that_do_are_hit(scale):
    scene = isospline.Scene()
    scene.add(triangle(), np.diag([scale, scale, scale, 1]))
    scene.add(sphere(), np.diag([scale, scale, scale, 1]) @ moved(*-CENTER))
    rays = scale * np.array([(0.2, 0.2, 10.0), (7.0, 0.0, 10.0)])
    for coherent in (False, True):
        hits = scene.cast_rays(np.hstack([rays, [(0, 0, -1)] * 2]), coherent=coherent)
        np.testing.assert_allclose(hits["t_hit"], scale * (10 - np.sqrt([63.92, 15.0])), rtol=1e-6)


# Removed objects


def test_materials_of_removed_objects_are_refused():
    scene = isospline.Scene([triangle(), triangle()])
    scene.remove(0)
    tracer = isospline.PathTracer(materials={0: isospline.Material()})
    with pytest.raises(ValueError, match="expected geometry ids of objects in the scene, got 0"):
        render(scene, isospline.camera_for(scene), size=(8, 8), light=tracer)


def test_parts_outlive_the_names_of_what_they_are_of():
    z, y, x = np.mgrid[-4:5, -4:5, -4:5].astype(float)

    def make():
        values = isospline.Volume(x, origin=(-4, -4, -4))
        surface = isospline.Isosurface(isospline.Volume(x**2 + y**2 + z**2, origin=(-4, -4, -4)), 9.0, inside="below")
        mesh = triangle()
        scene = isospline.Scene([surface, mesh])
        shading = isospline.Phong(color=isospline.ColorByVolume(values, [(0, 0, 0), (1, 1, 1)]))
        renderer = isospline.ProgressiveRenderer(
            scene, isospline.camera_for(scene), size=(8, 6), layers=("geometry_ids",)
        )
        intersector = isospline.RayMeshIntersector(surface)
        return scene, shading, renderer, intersector, surface.shell, surface.volume, mesh.vertices, mesh.faces

    kept = make()
    gc.collect()
    scene, shading, renderer, intersector, shell, volume, vertices, faces = kept
    assert scene.cast_rays([(0.1, 0.2, 9, 0, 0, -1)])["t_hit"][0] == pytest.approx(9 - np.sqrt(9 - 0.05), abs=1e-2)
    image = render(scene, isospline.camera_for(scene), size=(32, 24), light=shading)
    assert np.ptp(image.albedo[image.geometry_ids == 0], axis=0).min() > 0.2
    del scene, kept
    gc.collect()
    renderer.step()
    assert (renderer.image.geometry_ids == 0).any()
    assert intersector.intersects_any([(0.1, 0.2, 9)], [(0, 0, -1)])[0]
    assert len(shell.cells) == shell.count > 100
    assert volume.sample([(1, 1, 1)])[0] == pytest.approx(3, abs=0.1)
    np.testing.assert_array_equal(vertices, TRIANGLE)
    np.testing.assert_array_equal(faces, [(0, 1, 2)])


# Levels that change


def test_levels_change_while_the_scene_lives():
    surface, scene = sphere(), isospline.Scene()
    for x in (0, 40):
        scene.add(surface, moved(x, 0, 0))
    rays = [(11.5 + x, 11.5, 60, 0, 0, -1) for x in (0, 40)]

    def radii():
        return 48.5 - scene.cast_rays(rays)["t_hit"]

    np.testing.assert_allclose(radii(), 8, rtol=1e-6)
    for bad in (np.nan, np.inf):
        with pytest.raises(ValueError, match="^level: expected a finite number"):
            surface.level = bad
        np.testing.assert_allclose(radii(), 8, rtol=1e-6)
    with pytest.warns(UserWarning, match="level"):
        surface.level = -100.0  # nowhere
    assert np.isinf(scene.cast_rays(rays)["t_hit"]).all() and not scene.test_occlusions(rays).any()
    scene.object(1).level = 25.0
    np.testing.assert_allclose(radii(), 5, rtol=1e-6)
