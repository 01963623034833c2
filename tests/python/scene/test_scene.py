"""Ray queries on scenes against closed forms, dense sampling of the model and transformed copies of themselves."""

import numpy as np
import pytest

import isospline

INF = np.inf


def quadratic_sphere(size=24, degree=2, **options):
    """A volume whose model is exactly |x - centre|^2 in index space, centre = (size - 1) / 2 on each axis.

    Sums of k^2 beta^n(x - k) are x^2 + (n + 1) / 12, so coefficients k^2 - (n + 1) / 12 give x^2 (filter "none").
    """
    x = np.arange(size) - (size - 1) / 2
    square = x**2 - (degree + 1) / 12
    data = square[:, None, None] + square[None, :, None] + square[None, None, :]
    return isospline.Volume(data, degree=degree, filter="none", **options)


def random_directions(random, count):
    directions = random.normal(size=(count, 3))
    return directions / np.linalg.norm(directions, axis=1, keepdims=True)


def rays_at(random, centre, radius, count, distance):
    """Rays from a far sphere to points in a ball; some of them along axes."""
    origins = centre + distance * random_directions(random, count)
    targets = centre + radius * random.uniform(-1, 1, size=(count, 3))
    directions = targets - origins
    axis_parallel = random.random(count) < 0.1
    axes = np.eye(3)[random.integers(0, 3, count)] * random.choice([-1.0, 1.0], size=(count, 1))
    directions[axis_parallel] = axes[axis_parallel]
    origins[axis_parallel] = targets[axis_parallel] - distance * axes[axis_parallel]
    return np.hstack([origins, directions])


def sphere_roots(rays, centre, radius):
    """Both t of the crossings of rays with a sphere, in extended precision; NaN for misses."""
    rays = rays.astype(np.longdouble)
    offset, direction = rays[:, :3] - centre, rays[:, 3:]
    a = (direction**2).sum(axis=1)
    b = (offset * direction).sum(axis=1)
    closest = offset - (b / a)[:, None] * direction
    discriminant = (radius**2 - (closest**2).sum(axis=1)) / a
    with np.errstate(invalid="ignore"):
        half = np.sqrt(discriminant)
    return (-b / a - half).astype(float), (-b / a + half).astype(float)


def positions(rays, hits, where):
    return rays[where, :3] + hits["t_hit"][where, None] * rays[where, 3:]


@pytest.mark.parametrize("degree", [2, 3])
@pytest.mark.parametrize("distance", [40.0, 1e4, 1e6])
def test_sphere_closed_form(degree, distance):
    random = np.random.default_rng(1)
    centre, radius = np.full(3, 11.5), 8.0
    scene = isospline.Scene([isospline.Isosurface(quadratic_sphere(degree=degree), radius**2, inside="below")])
    rays = rays_at(random, centre, 9.0, 20000, distance)
    hits = scene.cast_rays(rays)
    expected, _ = sphere_roots(rays, centre, radius)

    # Rays within rounding of the silhouette may hit or miss.
    length = np.linalg.norm(rays[:, 3:], axis=1)
    offset = rays[:, :3] - centre
    miss_distance = np.linalg.norm(np.cross(offset, rays[:, 3:]), axis=1) / length
    clear = np.abs(miss_distance - radius) > 1e-6
    np.testing.assert_array_equal(np.isfinite(hits["t_hit"])[clear], np.isfinite(expected)[clear])

    hit = clear & np.isfinite(expected)
    assert hit.sum() > 5000
    points = positions(rays, hits, hit)
    assert np.abs(np.linalg.norm(points - centre, axis=1) - radius).max() < 1e-6
    steep = hit & (miss_distance < radius - 0.01)  # elsewhere the root is ill-conditioned: see the near-tangent rays
    np.testing.assert_array_less(np.abs(hits["t_hit"][steep] - expected[steep]) * length[steep], 1e-6)
    outward = (points - centre) / radius
    np.testing.assert_allclose(hits["primitive_normals"][hit], outward, atol=1e-6)
    assert (hits["geometry_ids"][hit] == 0).all()
    assert (hits["geometry_ids"][~np.isfinite(hits["t_hit"])] == isospline.INVALID_ID).all()


def test_near_tangent_rays():
    """Half-chords from a tenth down to a millionth of a voxel: both roots are in one cell or at its border."""
    random = np.random.default_rng(2)
    centre, radius = np.full(3, 11.5), 8.0
    scene = isospline.Scene([isospline.Isosurface(quadratic_sphere(), radius**2, inside="below")])
    count = 20000
    normal, tangent = random_directions(random, count), random_directions(random, count)
    tangent -= (tangent * normal).sum(axis=1, keepdims=True) * normal
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    half_chord = 10.0 ** random.uniform(-6, -1, count)
    closest = centre + np.sqrt(radius**2 - half_chord**2)[:, None] * normal
    rays = np.hstack([closest - 30 * tangent, tangent])
    hits = scene.cast_rays(rays)
    first, _ = sphere_roots(rays, centre, radius)
    wide = half_chord > 1e-5  # narrower chords are within the rounding of float64 coordinates
    assert np.isfinite(hits["t_hit"][wide]).all()
    assert np.abs(hits["t_hit"][wide] - first[wide]).max() < 1e-6


@pytest.mark.parametrize("method", ["exact", "reference"])
def test_limits_and_starts(method):
    surface = isospline.research.isosurface(quadratic_sphere(), 64.0, inside="below", method=method)
    scene = isospline.Scene([surface])
    outside, inside = (-20.0, 11.5, 11.25, 2.0, 0.0, 0.0), (11.5, 11.5, 11.25, 2.0, 0.0, 0.0)
    half = np.sqrt(64.0 - 0.0625)
    first, last = (31.5 - half) / 2, (31.5 + half) / 2

    def t_hit(ray, **limits):
        return scene.cast_rays([ray], **limits)["t_hit"][0]

    assert t_hit(outside) == pytest.approx(first, abs=1e-9)
    assert t_hit(inside) == pytest.approx(half / 2, abs=1e-9)
    assert t_hit(outside, t_near=first + 1e-6) == pytest.approx(last, abs=1e-9)
    assert t_hit(outside, t_near=first - 1e-6) == pytest.approx(first, abs=1e-9)
    assert t_hit(outside, t_far=first - 1e-6) == INF
    assert t_hit(outside, t_far=first + 1e-6) == pytest.approx(first, abs=1e-9)
    assert t_hit(outside, t_near=last + 1e-6) == INF
    assert t_hit(outside, t_near=5.0, t_far=1.0) == INF
    # From a point on the surface: one crossing is at zero, the other one on the other side of the ball.
    on_surface = (11.5 - half, 11.5, 11.25, 1.0, 0.0, 0.0)
    assert t_hit(on_surface, t_near=1e-9) == pytest.approx(2 * half, abs=1e-9)
    occluded = scene.test_occlusions([outside, inside, (-20, 0, 0, 0, 1, 0)])
    np.testing.assert_array_equal(occluded, [True, True, False])
    assert not scene.test_occlusions([outside], t_far=first - 1e-6)[0]
    assert not scene.test_occlusions([outside], t_near=last + 1e-6)[0]


def test_two_roots_in_one_cell_are_found_by_exact_and_missed_by_bracket():
    data = np.zeros((5, 5, 5))
    data[2, 2, 2] = 1.0
    volume = isospline.Volume(data, filter="none")
    level = 0.6 * 0.5625  # beta^2(x) = 0.6 at |x| = sqrt(0.15)
    ray = [(-3, 2, 2, 1, 0, 0)]
    exact = isospline.Scene([isospline.Isosurface(volume, level)]).cast_rays(ray)["t_hit"][0]
    assert exact == pytest.approx(5 - np.sqrt(0.15), abs=1e-7)
    assert (
        isospline.Scene([isospline.research.isosurface(volume, level, method="bracket")]).cast_rays(ray)["t_hit"][0]
        == INF
    )


def gyroid(size, periods=2.0):
    a = 2 * np.pi * periods * np.arange(size) / size
    z, y, x = np.meshgrid(a, a, a, indexing="ij")
    return np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)


def torus(size):
    g = np.linspace(-1, 1, size)
    z, y, x = np.meshgrid(g, g, g, indexing="ij")
    return np.hypot(np.hypot(x, y) - 0.6, z)


MODELS = {
    "gyroid": (gyroid(20), 0.3),
    "torus": (torus(20), 0.25),
    "plane": (np.add.outer(np.arange(12.0), np.add.outer(0.5 * np.arange(13), -0.25 * np.arange(14))), 5.3),
    "noise": (np.random.default_rng(0).normal(size=(12, 11, 13)), 0.1),
}


@pytest.mark.parametrize("boundary", ["mirror", "periodic"])
@pytest.mark.parametrize("degree", [1, 2, 3])
@pytest.mark.parametrize("model", MODELS)
def test_no_earlier_crossing_and_no_residual(model, degree, boundary):
    data, level = MODELS[model]
    volume = isospline.Volume(data, degree=degree, boundary=boundary)
    scene = isospline.Scene([isospline.Isosurface(volume, level)])
    random = np.random.default_rng(3)
    size = np.array(data.shape[::-1])
    centre = (size - 1) / 2
    rays = rays_at(random, centre, size.max() * 0.55, 400, 3.0 * size.max())
    hits = scene.cast_rays(rays)

    # Sample the model along each ray inside its domain, up to the hit.
    lower, upper = volume.bounds
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (np.stack([lower, upper])[:, None, :] - rays[:, :3]) / rays[:, 3:]
    t_enter, t_leave = np.nanmax(np.min(t, axis=0), axis=1), np.nanmin(np.max(t, axis=0), axis=1)
    inside = t_enter < t_leave
    end = np.minimum(t_leave, hits["t_hit"])[inside]
    samples = 1500
    s = np.linspace(1e-9, 1 - 1e-6, samples)
    along = t_enter[inside, None] + s * (end - t_enter[inside])[:, None]
    points = rays[inside, None, :3] + along[..., None] * rays[inside, None, 3:]
    values = volume.sample(points.reshape(-1, 3)).reshape(-1, samples) - level
    tolerance = 1e-9 * np.abs(data).max()
    above, below = (values > tolerance).any(axis=1), (values < -tolerance).any(axis=1)
    assert not (above & below).any()

    hit = np.isfinite(hits["t_hit"])
    assert hit.sum() > 30
    at_hit = positions(rays, hits, hit)
    gradient = volume.sample(at_hit, derivative=1)
    residual = np.abs(volume.sample(at_hit) - level)
    slope = np.abs((gradient * rays[hit, 3:]).sum(axis=1)) / np.linalg.norm(rays[hit, 3:], axis=1)
    assert (residual <= 1e-6 * np.maximum(slope, 1e-3)).all()
    expected = -gradient / np.linalg.norm(gradient, axis=1, keepdims=True)
    if degree > 1:  # the gradient of a model of degree 1 jumps at the faces of cells
        np.testing.assert_allclose(hits["primitive_normals"][hit], expected, atol=1e-5)
    cells = volume.cell_at(hits["primitive_ids"][hit])
    local = at_hit + (0.5 if degree % 2 == 0 else 0.0) - cells
    assert local.min() > -1e-6 and local.max() < 1 + 1e-6


def rotation(random):
    q, _ = np.linalg.qr(random.normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q))


@pytest.mark.parametrize("kind", ["rotated", "anisotropic", "mirrored", "distant"])
@pytest.mark.parametrize("by", ["volume", "transform"])
def test_affine_maps(kind, by):
    """If the same map moves rays and surface, hits do not change, for both ways to apply the map."""
    random = np.random.default_rng(4)
    spacing = np.array([0.7, 1.3, 3.1]) if kind != "rotated" else np.ones(3)
    direction = rotation(random) @ (np.diag([1, 1, -1]) if kind == "mirrored" else np.eye(3))
    origin = random.normal(size=3) * (1e6 if kind == "distant" else 20)
    data, level = MODELS["gyroid"]
    matrix = np.eye(4)
    matrix[:3, :3] = direction * spacing
    matrix[:3, 3] = origin

    plain = isospline.Isosurface(isospline.Volume(data), level)
    if by == "volume":
        volume = isospline.Volume(data, spacing=spacing, origin=origin, direction=direction)
        np.testing.assert_allclose(volume.affine, matrix, rtol=1e-15)
        scene = isospline.Scene([isospline.Isosurface(volume, level)])
    else:
        scene = isospline.Scene()
        scene.add(plain, transform=matrix)

    rays = rays_at(random, np.full(3, 9.5), 9.0, 5000, 60.0)
    mapped = np.hstack([rays[:, :3] @ matrix[:3, :3].T + matrix[:3, 3], rays[:, 3:] @ matrix[:3, :3].T])
    hits, mapped_hits = isospline.Scene([plain]).cast_rays(rays), scene.cast_rays(mapped)
    tolerance = 1e-9 if kind != "distant" else 1e-7  # in t: an origin of 1e6 rounds to 1e-10
    same = np.isfinite(hits["t_hit"]) == np.isfinite(mapped_hits["t_hit"])
    assert same.mean() > 0.9995  # grazing rays
    both = np.isfinite(hits["t_hit"]) & same
    difference = np.abs(hits["t_hit"][both] - mapped_hits["t_hit"][both])
    assert np.quantile(difference, 0.999) < tolerance
    normals = hits["primitive_normals"][both] @ np.linalg.inv(matrix[:3, :3])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    close = difference < tolerance
    np.testing.assert_allclose(mapped_hits["primitive_normals"][both][close], normals[close], atol=1e-5)
    lower, upper = scene.bounds
    cells = plain.shell.cells
    corners = np.array(np.meshgrid(*zip(cells.min(axis=0) - 0.5, cells.max(axis=0) + 0.5))).reshape(3, -1).T
    corners = corners @ matrix[:3, :3].T + matrix[:3, 3]
    np.testing.assert_allclose([lower, upper], [corners.min(axis=0), corners.max(axis=0)], rtol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("degree", [1, 2, 3])
def test_no_ray_escapes_a_closed_surface(degree):
    """A million rays from inside (over the three degrees), a third of them aimed at edges and corners of cells."""
    random = np.random.default_rng(5)
    size, count = 24, 350_000
    x = np.arange(size) - (size - 1) / 2
    radius = np.sqrt(x[:, None, None] ** 2 + x[None, :, None] ** 2 + x[None, None, :] ** 2)
    bumps = 0.8 * random.normal(size=radius.shape)
    surface = isospline.Isosurface(isospline.Volume(radius + bumps * (radius < 9), degree=degree), 9.0, inside="below")
    scene = isospline.Scene([surface])
    shift = 0.5 if degree % 2 == 0 else 0.0
    cells = surface.shell.cells
    origins = 11.5 + random.uniform(-2, 2, size=(count, 3))
    directions = random.normal(size=(count, 3))
    third = count // 3
    corners = cells[random.integers(0, len(cells), third)] - shift + random.integers(0, 2, size=(third, 3))
    along_edge = np.eye(3)[random.integers(0, 3, third)] * random.random((third, 1))
    edge = random.random(third) < 0.5
    directions[:third] = corners + np.where(edge[:, None], along_edge, 0.0) - origins[:third]
    assert np.isfinite(scene.cast_rays(np.hstack([origins, directions]))["t_hit"]).all()


def icosphere(subdivisions):
    phi = (1 + 5**0.5) / 2
    vertices = [(-1, phi, 0), (1, phi, 0), (-1, -phi, 0), (1, -phi, 0), (0, -1, phi), (0, 1, phi)]
    vertices += [(0, -1, -phi), (0, 1, -phi), (phi, 0, -1), (phi, 0, 1), (-phi, 0, -1), (-phi, 0, 1)]
    faces = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2)]
    faces += [(10, 7, 6), (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5)]
    faces += [(2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)]
    vertices, faces = np.array(vertices, float), np.array(faces)
    for _ in range(subdivisions):
        corners = vertices[faces]
        a, b, c = ((corners[:, i] + corners[:, (i + 1) % 3]) / 2 for i in range(3))
        vertices = np.concatenate([vertices, a, b, c])
        m = len(faces)
        n = len(vertices) - 3 * m + np.arange(3 * m).reshape(3, m)
        faces = np.concatenate(
            [
                np.stack([faces[:, 0], n[0], n[2]], axis=1),
                np.stack([faces[:, 1], n[1], n[0]], axis=1),
                np.stack([faces[:, 2], n[2], n[1]], axis=1),
                n.T,
            ]
        )
    return vertices / np.linalg.norm(vertices, axis=1, keepdims=True), faces


def test_mesh_and_isosurface_share_a_scene():
    """A mesh sphere and an isosurface sphere that interpenetrate: each ray meets the nearer one."""
    random = np.random.default_rng(6)
    vertices, faces = icosphere(5)
    scene = isospline.Scene([isospline.Isosurface(quadratic_sphere(), 36.0, inside="below")])
    mesh = isospline.Mesh(6.0 * vertices, faces)
    matrix = np.diag([1.0, -1.0, 1.0, 1.0])  # mirrored: the normal must still point outward
    matrix[:3, 3] = (16.0, 11.5, 11.5)
    assert scene.add(mesh, transform=matrix) == 1
    rays = rays_at(random, np.array([14.0, 11.5, 11.5]), 8.0, 20000, 500.0)
    hits = scene.cast_rays(rays)
    iso, _ = sphere_roots(rays, np.full(3, 11.5), 6.0)
    tri, _ = sphere_roots(rays, np.array([16.0, 11.5, 11.5]), 6.0)
    iso, tri = np.nan_to_num(iso, nan=INF), np.nan_to_num(tri, nan=INF)
    length = np.linalg.norm(rays[:, 3:], axis=1)
    with np.errstate(invalid="ignore"):
        clear = (np.abs(iso - tri) * length > 0.1) | (np.isinf(iso) & np.isinf(tri))
    expected = np.where(np.minimum(iso, tri) == INF, isospline.INVALID_ID, np.where(iso < tri, 0, 1))
    miss_distance = np.linalg.norm(np.cross(rays[:, :3] - (16, 11.5, 11.5), rays[:, 3:]), axis=1) / length
    clear &= np.abs(miss_distance - 6) > 0.02
    assert clear.mean() > 0.9
    np.testing.assert_array_equal(hits["geometry_ids"][clear], expected[clear])
    on_mesh = clear & (expected == 1)
    assert on_mesh.sum() > 2000
    hit_points = positions(rays, hits, on_mesh)
    triangles = (mesh.vertices @ matrix[:3, :3].T + matrix[:3, 3])[mesh.faces[hits["primitive_ids"][on_mesh]]]
    distance = ((hit_points - triangles[:, 0]) * hits["primitive_normals"][on_mesh]).sum(axis=1)
    assert np.abs(distance).max() < 1e-6
    outward = hit_points - (16.0, 11.5, 11.5)
    assert ((outward * hits["primitive_normals"][on_mesh]).sum(axis=1) > 0).all()


def test_level_change_takes_effect():
    surface = isospline.Isosurface(quadratic_sphere(), 64.0, inside="below")
    scene = isospline.Scene([surface])
    ray = [(-20, 11.5, 11.5, 1, 0, 0)]
    assert scene.cast_rays(ray)["t_hit"][0] == pytest.approx(31.5 - 8, abs=1e-9)
    surface.level = 49.0
    assert scene.cast_rays(ray)["t_hit"][0] == pytest.approx(31.5 - 7, abs=1e-9)


def test_shapes_types_and_empty_scenes():
    empty = isospline.Scene()
    assert len(empty) == 0
    hits = empty.cast_rays(np.zeros((2, 3, 6)) + (0, 0, 0, 0, 0, 1))
    assert {name: (array.shape, array.dtype) for name, array in hits.items()} == {
        "t_hit": ((2, 3), np.float64),
        "geometry_ids": ((2, 3), np.uint32),
        "primitive_ids": ((2, 3), np.uint64),
        "primitive_normals": ((2, 3, 3), np.float64),
    }
    assert np.isinf(hits["t_hit"]).all()
    scene = isospline.Scene([isospline.Isosurface(quadratic_sphere(), 64.0)])
    assert scene.cast_rays(np.zeros((0, 6)))["t_hit"].shape == (0,)
    for dtype in (np.float32, np.float64):
        rays = np.array([[-20, 11.5, 11.5, 1, 0, 0]] * 4, dtype=dtype)
        np.testing.assert_allclose(scene.cast_rays(rays[::2])["t_hit"], 23.5, atol=1e-6)
        np.testing.assert_allclose(scene.cast_rays(np.asfortranarray(rays))["t_hit"], 23.5, atol=1e-6)
    # Negative limits reach behind the origin.
    assert scene.cast_rays([(50, 11.5, 11.5, 1, 0, 0)], t_near=-100)["t_hit"][0] == pytest.approx(-46.5)
    assert scene.memory > 0
    assert "2 objects" in repr(isospline.Scene([isospline.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])] * 2))


@pytest.mark.parametrize(
    ("rays", "error", "message"),
    [
        (np.zeros((3, 5)), ValueError, r"rays: expected shape \(\.\.\., 6\), got \(3, 5\)"),
        ([(0, 0, 0, 0, 0, 0)], ValueError, "rays: expected directions that are not zero"),
        ([(0, 0, 0, 1e-200, 0, 0)], ValueError, r"lengths from 1e-150 to 1e150, got \(1e-200, 0, 0\) in ray 0"),
        ([(0, 0, np.nan, 0, 0, 1)], ValueError, "rays: expected finite"),
        ([(0, 0, 0, 0, np.inf, 1)], ValueError, "rays: expected finite"),
        (np.zeros((3, 6), dtype=complex), TypeError, "rays: "),
        (np.zeros((3, 6), dtype=object), TypeError, "rays: "),
        ("rays", TypeError, "rays: "),
    ],
)
def test_bad_rays(rays, error, message):
    scene = isospline.Scene([isospline.Isosurface(quadratic_sphere(), 64.0)])
    for query in (scene.cast_rays, scene.test_occlusions):
        with pytest.raises(error, match=message):
            query(rays)


def test_bad_objects():
    with pytest.raises(TypeError, match="objects: expected an Isosurface, a Mesh, or a mesh of"):
        isospline.Scene([3])
    surface = isospline.Isosurface(quadratic_sphere(), 64.0)
    scene = isospline.Scene()
    for transform, message in [
        (np.eye(3), r"transform: expected shape \(4, 4\)"),
        (np.zeros((4, 4)), "transform: "),
        (np.diag([1.0, 1.0, 0.0, 1.0]), "transform: expected an invertible map"),
        (np.full((4, 4), np.nan), "transform: expected finite numbers"),
    ]:
        with pytest.raises(ValueError, match=message):
            scene.add(surface, transform=transform)
    assert len(scene) == 0
    with pytest.raises(ValueError, match="t_near: expected a number"):
        scene.cast_rays([(0, 0, 0, 1, 0, 0)], t_near=np.nan)
    with pytest.raises(TypeError):
        scene.cast_rays([(0, 0, 0, 1, 0, 0)], tfar=3)
    with pytest.raises(ValueError, match="vertices: expected finite numbers"):
        isospline.Mesh([(0, 0, 0), (np.nan, 0, 0)], np.zeros((0, 3), int))
    with pytest.raises(ValueError, match="faces: .* got 3 in face 0"):
        isospline.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 3)])
    with pytest.raises(ValueError, match="faces: .* got -1 in face 0"):
        isospline.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, -1)])
    with pytest.raises(ValueError, match=r"faces: expected shape \(F, 3\)"):
        isospline.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2, 0)])
