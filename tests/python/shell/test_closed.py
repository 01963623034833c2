"""Solids closed at the border of their volume, against convex polyhedra in NumPy, SciPy's model, and trimesh.

ISOSPLINE_TEST_AFFINES sets the number of random volumes; 10^5 were tried.
"""

import copy
import itertools
import os
import pickle

import numpy as np
import pytest
import scipy.ndimage
import scipy.spatial

import isospline

AFFINES = int(os.environ.get("ISOSPLINE_TEST_AFFINES", 300))
CORNERS = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)])


def random_place(rng, oblique):
    """Spacing with two decimals and origin with one, as in the headers of CT, and a direction."""
    spacing, origin = np.round(rng.uniform(0.1, 3, 3), 2), np.round(rng.uniform(-200, 200, 3), 1)
    direction = np.eye(3)
    if oblique:
        direction = np.linalg.qr(rng.normal(size=(3, 3)))[0]  # also mirrored
        if rng.random() < 0.3:
            direction[:, 2] += rng.uniform(-0.5, 0.5) * direction[:, 1]  # the tilt of a gantry
    return dict(spacing=spacing, origin=origin, direction=direction)


def domain_of(volume):
    """The map from the unit cube to the domain of a volume: a matrix and a vector."""
    samples = np.array(volume.shape[::-1])
    beyond = 0.5 if volume.degree % 2 == 0 else 0.0
    matrix = volume.affine[:3, :3] * (samples - 1 + 2 * beyond)
    return matrix, volume.affine[:3, :3] @ np.full(3, -beyond) + volume.affine[:3, 3]


def border_planes(volume):
    """The border of a volume as half-spaces that a user would write."""
    matrix, origin = domain_of(volume)
    normals = np.linalg.inv(matrix)
    corner = origin + matrix.sum(axis=1)
    return [isospline.HalfSpace(point, sign * n) for n in normals for point, sign in ((origin, 1), (corner, -1))]


def closings(volume, oblique):
    """All ways to close a solid at the border."""
    yield dict(closed=True)
    yield dict(clip=border_planes(volume), capped=True)
    if not oblique:
        yield dict(clip=isospline.Box(*volume.bounds), capped=True)


def distances_from_triangles(points, triangles):
    """Distances of points from the nearest of a few triangles, by brute force."""
    a, b, c = triangles.transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    area = np.linalg.norm(normal, axis=1)
    a, b, c, normal = a[area > 0], b[area > 0], c[area > 0], normal[area > 0] / area[area > 0, None]
    least = np.full(len(points), np.inf)
    height = np.einsum("ptk,tk->pt", points[:, None] - a, normal)
    foot = points[:, None] - height[..., None] * normal
    inside = np.ones(height.shape, bool)
    for p, q in ((a, b), (b, c), (c, a)):
        edge = q - p
        inside &= np.einsum("ptk,tk->pt", foot - p, np.cross(normal, edge)) >= 0
        along = np.clip(np.einsum("ptk,tk->pt", points[:, None] - p, edge) / (edge**2).sum(1), 0, 1)
        least = np.minimum(least, np.linalg.norm(points[:, None] - p - along[..., None] * edge, axis=2).min(1))
    return np.minimum(least, np.where(inside, abs(height), np.inf).min(1))


class Polyhedron:
    """A convex polyhedron, by its corners."""

    def __init__(self, corners):
        self.hull = scipy.spatial.ConvexHull(corners)
        self.triangles = corners[self.hull.simplices]
        self.normals, self.offsets = self.hull.equations[:, :3], -self.hull.equations[:, 3]

    def signed_distances(self, points):
        outside = (points @ self.normals.T - self.offsets).max(axis=1) > 0
        return np.where(outside, 1, -1) * distances_from_triangles(points, self.triangles)

    def chords(self, rays):
        """t of the entry and the exit of each line; entry > exit for a miss."""
        speed, room = rays[:, 3:] @ self.normals.T, self.offsets - rays[:, :3] @ self.normals.T
        with np.errstate(divide="ignore", invalid="ignore"):
            t = room / speed
        is_beside = ((speed == 0) & (room < 0)).any(axis=1)  # parallel to a face, and outside of it
        enter = np.where(is_beside, np.inf, np.where(speed < 0, t, -np.inf).max(axis=1))
        leave = np.where(speed > 0, t, np.inf).min(axis=1)
        return enter, leave


def points_and_rays(rng, volume, count=16):
    """Points beside each face, random points, and rays between points."""
    matrix, origin = domain_of(volume)
    beside = np.full((6, 3), 0.5)
    gap = rng.choice([1e-6, 1e-3, 0.05, 0.3])
    for face in range(6):
        beside[face, face % 3] = -gap if face < 3 else 1 + gap
    points = np.concatenate([beside, rng.uniform(-0.4, 1.4, (count, 3)), rng.uniform(0, 1, (4, 3))])
    points = points @ matrix.T + origin
    towards = np.concatenate([np.full((6, 3), 0.5), rng.uniform(0, 1, (count + 4, 3))]) @ matrix.T + origin
    along = np.eye(3)[rng.integers(0, 3, len(points))] @ matrix.T  # parallel to faces
    return points, np.concatenate([np.hstack([points, towards - points]), np.hstack([points, along])])


def mistakes(rng, surface, solid):
    """What a surface tells wrongly about a convex solid."""
    points, rays = points_and_rays(rng, surface.volume)
    exact = 1e-9 * (abs(points).max() + np.ptp(points))
    scene = isospline.Scene([surface])
    length = np.linalg.norm(rays[:, 3:], axis=1)
    enter, leave = solid.chords(rays)
    clear = (abs(leave - enter) * length > 1e3 * exact) & (abs(leave) * length > exact) & (abs(enter) * length > exact)
    first = np.where((enter < leave) & (leave > 0), np.where(enter > 0, enter, leave), np.inf)
    count = np.where(enter < leave, (enter > 0).astype(int) + (leave > 0), 0)
    found = set()
    for coherent in (False, True):
        t = scene.cast_rays(rays, coherent=coherent)["t_hit"]
        hit = np.isfinite(t) & np.isfinite(first)
        wrong = np.isfinite(t) != np.isfinite(first)
        wrong[hit] = abs(t[hit] - first[hit]) * length[hit] > exact
        found |= {"first hit"} if wrong[clear].any() else set()
    counted = scene.count_intersections(rays)
    found |= {"number of crossings"} if (counted != count)[clear].any() else set()
    found |= {"parity"} if (counted % 2 != (surface.contains(rays[:, :3])))[clear].any() else set()
    for coherent in (False, True):
        occluded = scene.test_occlusions(rays, coherent=coherent)
        found |= {"occlusion"} if (occluded != np.isfinite(first))[clear].any() else set()
    expected = solid.signed_distances(points)
    apart = abs(expected) > exact
    found |= {"contains"} if (surface.contains(points) != (expected < 0))[apart].any() else set()
    found |= {"signed distance"} if (abs(surface.signed_distance(points) - expected) > exact).any() else set()
    nearest = surface.closest_points(points)
    found |= {"closest point"} if (abs(nearest["distances"] - abs(expected)) > exact).any() else set()
    on_it = abs(solid.signed_distances(nearest["points"])) <= exact
    found |= {"point beside the solid"} if not on_it.all() else set()
    in_scene = scene.closest_points(points)["distances"]
    found |= {"closest point of the scene"} if (abs(in_scene - abs(expected)) > exact).any() else set()
    return found


def is_closed(mesh, solid):
    """Whether a mesh is closed and is a solid's boundary."""
    shape = mesh.to_trimesh()
    return (
        shape.is_watertight
        and shape.volume == pytest.approx(solid.hull.volume, rel=1e-6)
        and shape.area == pytest.approx(solid.hull.area, rel=1e-6)
    )


@pytest.mark.sweep(3)
@pytest.mark.slow
@pytest.mark.parametrize("oblique", [False, True])
@pytest.mark.parametrize("degree", [1, 2, 3])
def test_a_full_volume_is_a_parallelepiped(degree, oblique):
    """No room decides for itself whether the border and the plane of a cut are the same."""
    rng = np.random.default_rng(100 * degree + oblique)
    wrong = []
    for number in range(max(AFFINES // 6, 20)):
        shape = rng.integers(2, 10, 3)
        volume = isospline.Volume(np.ones(shape), degree=degree, **random_place(rng, oblique))
        matrix, origin = domain_of(volume)
        solid = Polyhedron(CORNERS @ matrix.T + origin)
        for options in closings(volume, oblique):
            surface = isospline.Isosurface(volume, 0.5, **options)
            found = mistakes(rng, surface, solid)
            if number % 16 == 0:
                found |= set() if is_closed(surface.to_mesh(), solid) else {"mesh"}
                found |= set() if surface.area().value == pytest.approx(solid.hull.area, rel=1e-9) else {"area"}
                found |= (
                    {"bounds"} if abs(surface.bounds - volume.bounds).max() > 1e-9 * abs(volume.bounds).max() else set()
                )
                lengths = np.linalg.norm(matrix, axis=0)
                middle = origin + matrix @ (0.5, 0.5, 0)
                heights = 1 / np.linalg.norm(np.linalg.inv(matrix), axis=1)
                if heights[2] < 0.5 * lengths[:2].min() and not oblique:
                    thickness = surface.thickness(middle, ripple=0)
                    found |= {"thickness"} if abs(thickness - heights[2]) > 1e-6 * heights[2] else set()
            if found:
                wrong.append((volume.affine.tolist(), shape.tolist(), sorted(options), sorted(found)))
    assert not wrong, f"{len(wrong)} wrong, for example {wrong[0]}"


@pytest.mark.slow
@pytest.mark.parametrize("oblique", [False, True])
def test_a_half_full_volume_is_a_cut_parallelepiped(oblique):
    """At degree 1, the model of a linear function is the function: its solid is a box with a plane through it."""
    rng = np.random.default_rng(7 + oblique)
    wrong = []
    for _ in range(max(AFFINES // 6, 20)):
        shape = rng.integers(2, 9, 3)
        z, y, x = np.meshgrid(*(np.linspace(0, 1, count) for count in shape), indexing="ij")
        slope = rng.normal(size=3)
        level = (rng.uniform(0.2, 0.8, 3) * slope).sum()
        volume = isospline.Volume(slope[0] * x + slope[1] * y + slope[2] * z, degree=1, **random_place(rng, oblique))
        matrix, origin = domain_of(volume)
        value = CORNERS @ slope - level
        corners = list(CORNERS[value > 0].astype(float))
        for i, j in itertools.combinations(range(8), 2):
            if abs(CORNERS[i] - CORNERS[j]).sum() == 1 and value[i] * value[j] < 0:
                corners.append(CORNERS[i] + value[i] / (value[i] - value[j]) * (CORNERS[j] - CORNERS[i]))
        solid = Polyhedron(np.array(corners) @ matrix.T + origin)
        for options in closings(volume, oblique):
            # Stored coefficients have single precision.
            surface = isospline.Isosurface(volume, level, **options)
            points, rays = points_and_rays(rng, volume)
            size = np.linalg.norm(matrix, axis=0).max()
            steep = np.linalg.norm(np.linalg.inv(matrix).T @ slope)
            single = 1e-5 * (abs(slope).sum() / steep + 1e-3 * size)
            distances = solid.signed_distances(points)
            found = set()
            if (abs(surface.signed_distance(points) - distances) > single).any():
                found.add("signed distance")
            if (surface.contains(points) != (distances < 0))[abs(distances) > single].any():
                found.add("contains")
            scene = isospline.Scene([surface])
            if (scene.count_intersections(rays) % 2 != surface.contains(rays[:, :3])).any():
                found.add("parity")
            shape_of = surface.to_mesh().to_trimesh()
            if not shape_of.is_watertight or abs(shape_of.volume / solid.hull.volume - 1) > 1e-4:
                found.add("mesh")
            if abs(surface.area().value / solid.hull.area - 1) > 1e-4:
                found.add("area")
            if found:
                wrong.append((volume.affine.tolist(), shape.tolist(), sorted(options), sorted(found)))
    assert not wrong, f"{len(wrong)} wrong, for example {wrong[0]}"


@pytest.mark.sweep(3)
@pytest.mark.slow
@pytest.mark.parametrize("degree", [1, 2, 3])
@pytest.mark.parametrize("inside", ["above", "below"])
def test_noise_is_closed(degree, inside, rng):
    """Integer noise at a level between samples, in oblique volumes, against SciPy's model and trimesh."""
    samples = rng.integers(0, 9, (7, 6, 5)).astype(float)
    volume = isospline.Volume(samples, degree=degree, **random_place(rng, True))
    surface = isospline.Isosurface(volume, 4.5, closed=True, inside=inside)
    matrix, origin = domain_of(volume)
    unit = rng.uniform(-0.2, 1.2, (2000, 3))
    points = unit @ matrix.T + origin

    def model(points, volume=volume, samples=samples):
        index = (points - volume.affine[:3, 3]) @ np.linalg.inv(volume.affine[:3, :3]).T
        return scipy.ndimage.map_coordinates(samples, index.T[::-1], order=degree, mode="mirror")

    value = model(points)
    expected = ((unit > 0) & (unit < 1)).all(axis=1) & ((value > 4.5) == (inside == "above"))
    clear = abs(value - 4.5) > 1e-4
    contains = surface.contains(points)
    np.testing.assert_array_equal(contains[clear], expected[clear])
    scene = isospline.Scene([surface])
    rays = np.hstack([points, rng.normal(size=points.shape)])
    np.testing.assert_array_equal(scene.count_intersections(rays) % 2 == 1, contains)
    assert np.isfinite(scene.cast_rays(rays[contains], coherent=True)["t_hit"]).all()
    mesh = surface.to_mesh().to_trimesh()
    assert mesh.is_watertight
    # The surface is nearer than all points on the other side, and not much nearer than those of a fine grid.
    grid = np.stack(np.meshgrid(*(np.linspace(-0.1, 1.1, 40),) * 3), axis=-1).reshape(-1, 3)
    value = model(grid @ matrix.T + origin)
    solid = ((grid > 0) & (grid < 1)).all(axis=1) & ((value > 4.5) == (inside == "above"))
    near = points[:150][clear[:150]]
    on_other_side = np.where(
        contains[:150][clear[:150]],
        *(scipy.spatial.cKDTree(grid[side] @ matrix.T + origin).query(near)[0] for side in (~solid, solid)),
    )
    distances = abs(surface.signed_distance(near))
    assert (distances <= on_other_side * (1 + 1e-6)).all()
    edge = 1.2 / 39 * np.linalg.norm(matrix, axis=0).sum()
    assert (on_other_side - distances < edge).mean() > 0.97
    on_caps = surface.sample_points(2000)["primitive_ids"] >= volume.cell_count
    part = 1 - isospline.Isosurface(volume, 4.5, inside=inside).area(order=4).value / surface.area(order=4).value
    assert abs(on_caps.mean() - part) < 5 * np.sqrt(part * (1 - part) / 2000)
    areas = surface.components(measured=True, order=4).areas
    assert areas.sum() == pytest.approx(surface.area(order=4).value, rel=1e-9)


def half_solid(**options):
    """f = x at degree 1, which is solid above 4, in an oblique volume of 8 x 8 x 8 unit cells."""
    turn = np.array([(0.6, -0.8, 0), (0.8, 0.6, 0), (0, 0, 1)])
    samples = np.broadcast_to(np.arange(9.0), (9, 9, 9))
    volume = isospline.Volume(samples, degree=1, direction=turn, origin=(3, 4, 5))
    return isospline.Isosurface(volume, 4.0, **options), turn


def test_closed_capped_and_clipped():
    """The border is closed by `closed` alone, a cut by `capped` alone."""
    face, half = 64.0, 32.0
    quarter = isospline.HalfSpace((3, 4, 9), (0, 0, 1))  # keeps z above 4
    areas = {
        (False, False, False): face,
        (False, False, True): 2 * face + 4 * half,
        (True, False, False): half,
        (True, True, False): half + half,
        (True, False, True): half + half + 2 * half / 2 + half,
        (True, True, True): half + half + 2 * half / 2 + half + half,
    }
    for (is_clipped, capped, closed), area in areas.items():
        surface, turn = half_solid(clip=quarter if is_clipped else None, capped=capped, closed=closed)
        assert surface.closed == closed and surface.capped == capped
        assert surface.area().value == pytest.approx(area, rel=1e-9), (is_clipped, capped, closed)
        mesh = surface.to_mesh().to_trimesh()
        assert mesh.area == pytest.approx(area, rel=1e-9)
        assert mesh.is_watertight == (closed and (capped or not is_clipped))
        assert surface.enclosed_volume().value == pytest.approx(4 * 8 * (4 if is_clipped else 8), rel=1e-9)


def test_primitive_ids_and_normals_of_the_border():
    """Lower and upper x, y, z of the volume's own axes, after the planes of the clip."""
    clip = [isospline.HalfSpace((3, 4, 5), (0, 0, 1)), isospline.HalfSpace((0, 0, 99), (0, 0, -1))]
    for cut in (None, clip):
        surface, turn = half_solid(closed=True, clip=cut)
        scene = isospline.Scene([surface])
        normals = np.array([sign * axis for axis in turn.T for sign in (-1.0, 1.0)])
        middle = turn @ (6, 4, 4) + (3, 4, 5)
        hits = scene.cast_rays(
            np.hstack([middle + 20 * normals, -normals]), outputs=("primitive_ids", "primitive_normals")
        )
        first = surface.volume.cell_count
        expected = first + np.arange(6) + (2 if cut else 0)
        if cut:
            expected[4] = first  # the first plane of the clip is the lower border along z
        np.testing.assert_array_equal(hits["primitive_ids"][1:], expected[1:])
        assert hits["primitive_ids"][0] < first  # the isosurface itself
        np.testing.assert_allclose(hits["primitive_normals"], normals, atol=1e-14)


def test_capping_needs_a_cut():
    with pytest.raises(ValueError, match="^capped: expected a clip whose cuts are capped, or closed=True"):
        half_solid(capped=True)
    half_solid(capped=True, closed=True)


def test_closed_surfaces_are_copied():
    surface, _ = half_solid(closed=True)
    for same in (copy.copy(surface), pickle.loads(pickle.dumps(surface)), surface.with_level(5.0)):
        assert same.closed
    assert surface.with_level(5.0).area().value == pytest.approx(2 * 64 + 4 * 24)
    surface.level = 5.0
    assert surface.area().value == pytest.approx(2 * 64 + 4 * 24)
    assert not half_solid()[0].closed


def test_the_cell_on_the_inner_side_of_a_plane_has_its_cap(rng):
    """A cut on a face between a cell that the mask removes and one that it keeps."""
    for keeps_inner in (True, False):
        mask = np.zeros((6, 6, 6), bool)
        mask[:, :, 3:] = keeps_inner
        mask[:, :, :3] = not keeps_inner
        volume = isospline.Volume(np.ones((6, 6, 6)), spacing=(0.3, 0.7, 1.1), origin=(0.1, 0.2, 0.3))
        x = 0.1 + 0.3 * 2.5
        clip = isospline.HalfSpace((x, 0, 0), (1, 0, 0))
        surface = isospline.Isosurface(volume, 0.5, mask=mask, clip=clip, capped=True)
        sides = rng.uniform((0.2, 0.5), (3, 5), (200, 2))
        rays = np.hstack([np.full((200, 1), -9.0), sides, np.tile((1.0, 0, 0), (200, 1))])
        hits = isospline.Scene([surface]).cast_rays(rays)["t_hit"]
        distances = surface.closest_points(np.hstack([np.full((200, 1), x - 1), sides]))["distances"]
        area = surface.area().value
        if keeps_inner:
            np.testing.assert_allclose(hits, x + 9, rtol=1e-12)
            np.testing.assert_allclose(distances, 1, rtol=1e-12)
            assert area == pytest.approx(0.7 * 1.1 * 36)
        else:
            assert np.isinf(hits).all() and np.isinf(distances).all() and area == 0
