"""Where objects coincide, the smallest geometry id is hit: by single rays and packets, whatever the other rays are."""

import numpy as np
import pytest

import isospline

# A field whose level 2.5 is the plane z = 2.5, and the same plane as two meshes.
RAMP = np.broadcast_to(np.arange(6.0)[:, None, None], (6, 7, 8))
CORNERS = np.array([(0, 0, 2.5), (7, 0, 2.5), (7, 6, 2.5), (0, 6, 2.5), (3, 2, 2.5)])


def plane_isosurface():
    return isospline.Isosurface(isospline.Volume(RAMP, degree=1), 2.5)


def plane_mesh(order):
    return isospline.Mesh(CORNERS, np.array([(0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)])[order])


@pytest.mark.parametrize("coherent", [False, True])
@pytest.mark.parametrize("pair", ["isosurfaces", "meshes"])
def test_the_first_of_two_equal_objects_is_hit_unless_another_one_is_nearer(pair, coherent):
    """Rays through corners and edges, too; the plane is met at a t that is exact in binary."""
    rng = np.random.default_rng(1)
    ends = np.column_stack([rng.integers(1, 12, (300, 2)) / 2, np.full(300, 2.5)])
    directions = np.column_stack([rng.integers(-2, 3, (300, 2)), rng.choice([-2, -1, 1, 2], 300)])
    t = rng.choice([1, 2, 4, 64], 300)
    rays = np.column_stack([ends - t[:, None] * directions, directions])
    equal = (
        [plane_isosurface(), plane_isosurface()]
        if pair == "isosurfaces"
        else [plane_mesh([2, 3, 1, 0]), plane_mesh([0, 1, 2, 3])]
    )
    scene = isospline.Scene(equal)
    hits = scene.cast_rays(rays, coherent=coherent)
    np.testing.assert_array_equal(hits.geometry_ids, 0)
    np.testing.assert_allclose(hits.t_hit, t, rtol=1e-14)
    above = np.eye(4)
    above[2, 3] = 2.0**-20
    for each in (plane_mesh([0, 1, 2, 3]), plane_isosurface()):
        added = scene.add(each, transform=above)
        hits = scene.cast_rays(rays, coherent=coherent)
        np.testing.assert_array_equal(hits.geometry_ids, np.where(directions[:, 2] < 0, added, 0))
        scene.remove(added)


def integer_scene(seed, closed):
    """Isosurfaces of one field in two lattices, their mesh twice, with other face numbers; and rays through samples."""
    rng = np.random.default_rng(seed)
    samples = rng.integers(0, 4, rng.integers(4, 9, 3)).astype(float)
    spacing, origin = np.round(rng.uniform(0.1, 3, 3), 2), np.round(rng.uniform(-200, 200, 3), 1)
    last = origin + (0, 0, (len(samples) - 1) * spacing[2])
    volumes = [
        isospline.Volume(samples, degree=1 + seed % 3, spacing=spacing, origin=origin),
        isospline.Volume(
            samples[::-1], degree=1 + seed % 3, spacing=spacing, origin=last, direction=np.diag([1, 1, -1])
        ),
    ]
    surfaces = [isospline.Isosurface(volume, 1.5 + seed % 2 / 2, closed=closed) for volume in volumes]
    mesh = surfaces[0].to_mesh()
    again = isospline.Mesh(mesh.vertices, rng.permutation(mesh.faces))
    objects = [surfaces[0], mesh, surfaces[1], again]
    shape = samples.shape[::-1]
    begin, end = (rng.integers(-1, np.add(shape, 1), (800, 3)) + rng.choice([0, 0.5], (800, 3)) for _ in range(2))
    directions = (end - begin) * spacing
    moved = rng.choice([0, 1e3, 1e6]) * directions
    rays = np.hstack([origin + begin * spacing - moved, directions])[np.any(begin != end, axis=1)]
    return [objects[i] for i in rng.permutation(4)], rays


def same(hits, others, order=slice(None)):
    for name, array in hits.items():
        np.testing.assert_array_equal(array, others[name][order])


@pytest.mark.sweep(8)
@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("seed", range(12))
def test_hits_of_coincident_objects_do_not_depend_on_other_rays(seed, closed):
    objects, rays = integer_scene(seed, closed)
    scene = isospline.Scene(objects)
    hits = scene.cast_rays(rays, coherent=False)
    same(scene.cast_rays(rays, coherent=True), hits)
    order = np.random.default_rng(seed).permutation(len(rays))
    same(scene.cast_rays(rays[order], coherent=True), hits, order)
    for skipped in (1, 3, 5):
        same(scene.cast_rays(rays[skipped:], coherent=True), hits, slice(skipped, None))
    # The triangle of a mesh is the one that is hit without the other objects.
    for geometry_id, each in zip(scene.ids, objects):
        on = hits.geometry_ids == geometry_id
        if isinstance(each, isospline.Mesh):
            alone = isospline.Scene(each).cast_rays(rays[on])
            np.testing.assert_array_equal(alone.t_hit, hits.t_hit[on])
            np.testing.assert_array_equal(alone.primitive_ids, hits.primitive_ids[on])


@pytest.mark.parametrize("seed", range(12))
def test_of_all_crossings_at_the_first_t_the_smallest_geometry_id_is_hit(seed):
    """All crossings of each ray, sorted by NumPy."""
    objects, rays = integer_scene(seed, closed=False)
    scene = isospline.Scene(objects)
    listed = scene.list_intersections(rays)
    order = np.lexsort([listed.geometry_ids, listed.t_hit, listed.ray_ids])
    hit_rays, first = np.unique(listed.ray_ids[order], return_index=True)
    t = np.full(len(rays), np.inf)
    ids = np.full(len(rays), isospline.INVALID_ID)
    t[hit_rays], ids[hit_rays] = listed.t_hit[order][first], listed.geometry_ids[order][first]
    ties = np.unique(np.column_stack([listed.ray_ids, listed.geometry_ids])[listed.t_hit == t[listed.ray_ids]], axis=0)
    assert len(ties) > 1.5 * len(hit_rays)
    for coherent in (False, True):
        hits = scene.cast_rays(rays, coherent=coherent)
        np.testing.assert_array_equal(hits.t_hit, t)
        np.testing.assert_array_equal(hits.geometry_ids, ids)
