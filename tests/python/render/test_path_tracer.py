"""The path tracer against closed forms and integrals taken by NumPy."""

import numpy as np
import pytest
import scipy.spatial
from layered import render
from placed_images import DIRECTIONS
from spheres import mesh_sphere, moved

import isospline
from isospline.colors import linear, srgb_to_linear

FLOOR = isospline.Mesh([[-90, -90, 0], [90, -90, 0], [90, 90, 0], [-90, 90, 0]], [[0, 1, 2], [0, 2, 3]])
MATTE = isospline.Material(linear(0.6), specular=0)
DOWN = isospline.OrthographicCamera((0, 0, 30), (0, 0, 0), up=(0, 1, 0), height=12)


def dot(a, b):
    return (a * b).sum(-1, keepdims=True)


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def hemisphere(count=400):
    """Directions of the upper hemisphere and their solid angles: the midpoint rule, denser towards the horizon."""
    polar = (np.arange(count) + 0.5) / count * np.pi / 2
    azimuth = (np.arange(2 * count) + 0.5) / count * np.pi
    polar, azimuth = np.meshgrid(polar, azimuth, indexing="ij")
    directions = np.stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], axis=-1)
    return directions, np.sin(polar) * (np.pi / 2 / count) * (np.pi / count)


def at_angle(degrees):
    return np.array([np.sin(np.radians(degrees)), 0, np.cos(np.radians(degrees))])


def albedo(material, to_viewer):
    """The fraction of even light that a material reflects to the viewer."""
    directions, solid_angle = hemisphere(700)
    f = material.evaluate(np.broadcast_to(to_viewer, directions.shape), directions)
    return (f * (directions[..., 2] * solid_angle)[..., None]).sum((0, 1))


def between(*values):
    """Values of a parameter, or of several, for `make ci-long` alone."""
    marks = pytest.mark.long
    return [pytest.param(*(each if isinstance(each, tuple) else (each,)), marks=marks) for each in values]


def assert_means(image, expected, tolerance=1e-5):
    """No pixel is wrong by six standard errors, and the reported standard errors are right.

    `tolerance` is the relative error of the expected value.
    """
    expected = np.broadcast_to(expected, image.variance.shape)
    error = np.sqrt(image.variance)
    deviation = np.abs(image.color[..., :3] - expected)
    assert (deviation <= 6 * error + tolerance * expected).all()
    noisy = error > 3 * tolerance * expected
    if noisy.mean() > 0.5:
        assert 0.6 < ((deviation[noisy] / error[noisy]) ** 2).mean() < 1.5


MATERIALS = [
    isospline.Material(linear((0.9, 0.5, 0.1)), metallic=metallic, roughness=roughness, specular=specular)
    for metallic in (0.0, 0.3, 1.0)
    for roughness in (0.15, 0.5, 1.0)
    for specular in (0.0, 0.1, 0.25, 0.5, 1.0)
]


@pytest.mark.parametrize("material", MATERIALS, ids=repr)
def test_a_material_is_the_published_formula_and_reciprocal(material, rng):
    o, i = (unit(rng.normal(size=(2000, 3)) + (0, 0, 0.5)) for _ in range(2))
    f = material.evaluate(o, i)
    np.testing.assert_allclose(f, material.evaluate(i, o), rtol=1e-12)
    below = (o[:, 2] <= 0) | (i[:, 2] <= 0)
    assert below.sum() > 100 and not f[below].any()

    o, i, f = o[~below], i[~below], f[~below]
    alpha, m = material.roughness**2, material.metallic
    h = unit(o + i)

    def fresnel(f0, f90, cosine):
        return f0 + (f90 - f0) * (1 - cosine) ** 5

    def smith(w):  # G1 of Walter et al. 2007, for the Lambda of Heitz 2014
        tangent = np.tan(np.arccos(np.clip(w[:, 2:], 0, 1)))
        return 2 / (1 + np.sqrt(1 + alpha**2 * tangent**2))

    cosine = np.clip(h[:, 2:], 0, 1)
    d = alpha**2 / (np.pi * (cosine**2 * (alpha**2 - 1) + 1) ** 2)
    g = 1 / (1 / smith(o) + 1 / smith(i) - 1)  # height-correlated
    coat = 0.08 * material.specular, min(1, 50 * 0.08 * material.specular)
    base = srgb_to_linear(material.color)
    f0 = (1 - m) * coat[0] + m * base
    f90 = (1 - m) * coat[1] + m
    specular = fresnel(f0, f90, dot(o, h)) * d * g / (4 * o[:, 2:] * i[:, 2:])
    diffuse = base / np.pi * (1 - m) * (1 - fresnel(*coat, o[:, 2:])) * (1 - fresnel(*coat, i[:, 2:]))
    np.testing.assert_allclose(f, diffuse + specular, rtol=1e-8)


@pytest.mark.parametrize("specular", [0.01, 0.1, 0.2, 0.25, 0.3, 0.5, 1])
def test_specular_is_the_reflectance_of_the_coat(specular):
    """Schlick's term, from the mirror reflection of a black material at two angles."""
    found = []
    for angle in (20, 80):
        o, cosine, alpha = at_angle(angle), np.cos(np.radians(angle)), 0.25
        f = isospline.Material(0, specular=specular, roughness=0.5).evaluate(o, o * (-1, 1, 1))[0]
        masking = np.sqrt(1 + alpha**2 * np.tan(np.radians(angle)) ** 2)
        found.append(f * np.pi * alpha**2 * masking * 4 * cosine**2)
    weights = [(1 - np.cos(np.radians(angle))) ** 5 for angle in (20, 80)]
    f0, f90 = np.linalg.solve([(1 - weight, weight) for weight in weights], found)
    assert f0 == pytest.approx(0.08 * specular)
    assert f90 == pytest.approx(min(1, 4 * specular))


@pytest.mark.parametrize("lens", [0, 2.0])
def test_a_single_sample_is_the_ray_that_ids_are_of(lens):
    scene = isospline.Scene([mesh_sphere(1, 24)])
    scene.add(mesh_sphere(1, 24), moved(1.2, 0.3, 0.4))
    camera = isospline.PerspectiveCamera((1, -6, 2), (0.5, 0, 0), aperture_radius=lens, focus_distance=5)
    materials = {0: isospline.Material((1, 0, 0), specular=0), 1: isospline.Material((0, 1, 0), specular=0)}
    tracer = isospline.PathTracer(
        materials=materials, max_bounces=1, lights=[isospline.EnvironmentLight(1, visible=False)]
    )
    image = render(scene, camera, size=(90, 70), light=tracer, samples=1)
    covered = image.geometry_ids != isospline.INVALID_ID
    assert 0.1 < covered.mean() < 0.9
    np.testing.assert_array_equal(image.color[..., 3], covered)
    assert not image.color[image.geometry_ids == 0][:, 1:3].any()
    assert not image.color[image.geometry_ids == 1][:, ::2].any()
    rays = camera.rays((90, 70))
    np.testing.assert_array_equal(scene.cast_rays(rays)["geometry_ids"], image.geometry_ids)

    # A first step of one sample is not a part of the later steps.
    renderer = isospline.ProgressiveRenderer(scene, camera, size=(90, 70), light=tracer)
    renderer.step(1)
    np.testing.assert_array_equal(renderer.image.color, image.color)
    renderer.step(3)
    expected = render(scene, camera, size=(90, 70), light=tracer, samples=4)
    assert renderer.samples == 4
    np.testing.assert_array_equal(renderer.image.color, expected.color)
    assert ((expected.color[..., 3] > 0) & (expected.color[..., 3] < 1)).any()


# `make test` has the ends of each range, and `make ci-long` what lies between.
@pytest.mark.sweep(2)
@pytest.mark.slow
@pytest.mark.parametrize("roughness", [0.2, *between(0.35, 0.6), 1.0])
@pytest.mark.parametrize(
    "metallic, specular", [(0, 0), *between((0, 0.05), (0, 0.25)), (0, 0.5), (0, 1), *between((0.5, 0.5)), (1, 0.5)]
)
def test_no_material_makes_light(roughness, metallic, specular):
    white = isospline.Material(1, metallic=metallic, roughness=roughness, specular=specular)
    parts = [albedo(white, at_angle(angle))[0] for angle in (0.01, 30, 60, 75, 85)]
    assert max(parts) < 1 + 1e-4
    assert min(parts) > 0.3
    if metallic == specular == 0:
        np.testing.assert_allclose(parts, 1, atol=1e-4)


# Faint coats are chosen too rarely for the samples of one pixel to tell their variance.
@pytest.mark.sweep(2)
@pytest.mark.slow
@pytest.mark.parametrize("material", [m for m in MATERIALS if m.specular in (0.0, 0.5, 1.0)][1::5], ids=repr)
@pytest.mark.parametrize("angle", [10, 70])
def test_even_light_on_a_plane_is_the_integral(material, angle):
    direction = at_angle(angle)
    camera = isospline.OrthographicCamera(30 * direction, (0, 0, 0), height=1)
    integrator = isospline.PathTracer(material, lights=[isospline.EnvironmentLight((1.0, 0.5, 2.0))])
    # With 256 samples per pixel, errors are not normal enough: for two of six seeds, one exceeded six standard errors.
    image = render(isospline.Scene([FLOOR]), camera, size=(24, 24), light=integrator, samples=1024)
    assert_means(image, albedo(material, direction) * (1.0, 0.5, 2.0), 1e-3)


def test_colors_at_vertices_tint_the_material():
    """In even light, the reflected light is the colour (Lambert's law), which is linear in a square here."""
    tint = np.array([(0.2, 1, 0.5), (0.8, 1, 0.5), (0.8, 0.3, 0.5), (0.2, 0.3, 0.5)])
    corners = np.array([(-5, -5, 0), (5, -5, 0), (5, 5, 0), (-5, 5, 0.0)])
    scene = isospline.Scene([isospline.Mesh(corners, FLOOR.faces, colors=linear(tint))])
    camera = isospline.OrthographicCamera((0, 0, 30), (0, 0, 0), up=(0, 1, 0), height=8)
    base = np.array((0.9, 0.6, 0.3))
    integrator = isospline.PathTracer(isospline.Material(linear(base), specular=0))
    image = render(scene, camera, size=(40, 40), light=integrator, samples=4)
    x, y = (image.position[..., axis, None].astype(float) for axis in (0, 1))
    expected = base * np.concatenate([0.5 + 0.06 * x, 0.65 - 0.07 * y, 0.5 + 0 * x], axis=-1)
    np.testing.assert_allclose(image.albedo, expected, atol=1e-6)
    # Samples are up to half a pixel, 0.1, from its centre.
    assert (np.abs(image.color[..., :3] - expected) < base * (0.006, 0.007, 0) + 1e-6).all()


def sphere_mesh():
    golden = (1 + 5**0.5) / 2
    vertices = np.array([(0, i, j * golden) for i in (-1, 1) for j in (-1, 1)], float)
    vertices = np.concatenate([np.roll(vertices, shift, axis=1) for shift in range(3)])
    return isospline.Mesh(vertices, scipy.spatial.ConvexHull(vertices).simplices)


def ball(radius=6.3):
    z, y, x = np.mgrid[-10:11, -10:11, -10:11].astype(float)
    volume = isospline.Volume(x**2 + y**2 + z**2, origin=(-10, -10, -10))
    return isospline.Isosurface(volume, radius**2, inside="below")


@pytest.mark.parametrize("shape", [ball(), sphere_mesh()], ids=["isosurface", "mesh"])
def test_white_furnace(shape):
    """White and convex, in even light: as bright as the light, at every pixel and without noise."""
    scene = isospline.Scene([shape])
    integrator = isospline.PathTracer(isospline.Material(1, specular=0), lights=[isospline.EnvironmentLight(0.75)])
    image = render(scene, isospline.camera_for(scene), size=(80, 60), light=integrator, samples=4)
    covered = image.color[..., 3] > 0
    assert covered.sum() > 500
    np.testing.assert_allclose(image.color[..., :3], 0.75 * image.color[..., 3:] + np.zeros(3), atol=1e-6)
    assert image.variance[image.color[..., 3] == 1].max() < 1e-12


def test_white_furnace_with_light_from_surface_to_surface():
    """In the hole of a torus, light also comes from other points; all of it arrives if no path is cut short."""
    field = isospline.volumes.torus()
    volume = field.volume(48)
    scene = isospline.Scene([isospline.Isosurface(volume, field.level)])
    camera = isospline.camera_for(scene, view=(0.5, -1, 1))
    white = isospline.Material(1, specular=0)
    image = render(scene, camera, size=(80, 60), light=isospline.PathTracer(white, max_bounces=10_000), samples=2)
    np.testing.assert_allclose(image.color[..., :3], image.color[..., 3:] + np.zeros(3), atol=1e-6)
    integrator = isospline.PathTracer(white, max_bounces=1)
    once = render(scene, camera, size=(80, 60), light=integrator, samples=2)
    assert (once.color[..., 0] < 0.5 * once.color[..., 3]).any()


def irradiance_of_polygon(position, normal, corners):
    """Lambert's formula for an even polygon of radiance 1, all of it above the horizon."""
    corners = unit(corners - position[..., None, :])
    following = np.roll(corners, -1, axis=-2)
    angle = np.arccos(np.clip(dot(corners, following), -1, 1))
    return 0.5 * np.abs((angle * dot(unit(np.cross(corners, following)), np.asarray(normal, float))).sum(-2))[..., 0]


LAMPS = {
    "ball": (
        isospline.SphereLight((1, 2, 5), 1.5, radiance=(2, 1, 3)),
        lambda at: np.pi * (1.5**2 * (5 - at[..., 2])) / np.linalg.norm(np.array((1, 2, 5)) - at, axis=-1) ** 3,
        (2, 1, 3),
    ),
    "small ball": (
        isospline.SphereLight((1, 2, 5), 1e-4, radiance=1e8),
        lambda at: np.pi * (1e-8 * (5 - at[..., 2])) / np.linalg.norm(np.array((1, 2, 5)) - at, axis=-1) ** 3,
        1e8,
    ),
    "rectangle": (
        isospline.RectangleLight((-1, 0, 3), (0, 2, 1), (3, 0, 0), radiance=(2, 1, 3)),
        lambda at: irradiance_of_polygon(
            at, (0, 0, 1), np.array([(-1, 0, 3), (-1, 2, 4), (2, 2, 4), (2, 0, 3)], float)
        ),
        (2, 1, 3),
    ),
    "point": (
        isospline.PositionalLight((1, 2, 5), intensity=(20, 10, 30)),
        lambda at: (5 - at[..., 2]) / np.linalg.norm(np.array((1, 2, 5)) - at, axis=-1) ** 3,
        (20, 10, 30),
    ),
    "sun": (
        isospline.DirectionalLight((3, 0, -4), intensity=(2, 1, 3)),
        lambda at: np.full(at.shape[:-1], 0.8),
        (2, 1, 3),
    ),
    "wide sun": (
        isospline.DirectionalLight((3, 0, -4), intensity=(2, 1, 3), angle=40),
        lambda at: np.full(at.shape[:-1], 0.8),
        (2, 1, 3),
    ),
    "widest sun": (
        isospline.DirectionalLight((0, 0, -1), intensity=(2, 1, 3), angle=180),
        lambda at: np.ones(at.shape[:-1]),
        (2, 1, 3),
    ),
}


@pytest.mark.sweep(4)
@pytest.mark.slow
@pytest.mark.parametrize("name", LAMPS)
def test_irradiance_below_a_lamp_is_the_closed_form(name):
    lamp, irradiance, radiance = LAMPS[name]
    size = (24, 24)
    # From the side, so that no lamp hides the floor.
    camera = isospline.PerspectiveCamera((0, -20, 10), (0, 0, 0), field_of_view=6)
    integrator = isospline.PathTracer(MATTE, lights=[lamp])
    scene = isospline.Scene([FLOOR])
    image = render(scene, camera, size=size, light=integrator, samples=512)
    # The mean over a pixel, from many of its points.
    fine = camera.rays((size[0] * 16, size[1] * 16))
    points = fine[..., :3] - fine[..., 3:] * (fine[..., 2:3] / fine[..., 5:6])
    mean = irradiance(points).reshape(size[1], 16, size[0], 16).mean((1, 3))
    assert_means(image, 0.6 / np.pi * mean[..., None] * radiance, 2e-4)


@pytest.mark.sweep(3)
@pytest.mark.slow
@pytest.mark.parametrize("roughness", [0.1, 0.4, 1.0])
@pytest.mark.parametrize("metallic", [0, 1])
def test_gloss_below_a_lamp_is_the_integral(roughness, metallic):
    """For every width of the highlight, so that either of the two sampling strategies finds the light."""
    material = isospline.Material(linear(0.9), metallic=metallic, roughness=roughness)
    center, radius, to_viewer = np.array((-4.0, 0.5, 5.0)), 2.0, at_angle(45)
    camera = isospline.OrthographicCamera(30 * to_viewer, (0, 0, 0), up=(0, 1, 0), height=1e-3)
    lamps = [isospline.SphereLight(center, radius, radiance=3), isospline.SphereLight((30, 30, 30), 1, radiance=0)]
    integrator = isospline.PathTracer(material, lights=lamps)
    image = render(isospline.Scene([FLOOR]), camera, size=(12, 12), light=integrator, samples=1024)

    # The integral over the lamp's cone, in steps of equal solid angle.
    n = 600
    cosine = 1 - (1 - np.sqrt(1 - radius**2 / (center @ center))) * (np.arange(n) + 0.5) / n
    azimuth = (np.arange(n) + 0.5) / n * 2 * np.pi
    cosine, azimuth = np.meshgrid(cosine, azimuth)
    z = unit(center)
    x = unit(np.cross(z, (0, 1, 0)))
    sine = np.sqrt(1 - cosine**2)
    directions = (sine * np.cos(azimuth))[..., None] * x + (sine * np.sin(azimuth))[..., None] * np.cross(z, x)
    directions += cosine[..., None] * z
    f = material.evaluate(np.broadcast_to(to_viewer, directions.shape), directions)
    solid_angle = 2 * np.pi * (1 - np.sqrt(1 - radius**2 / (center @ center)))
    expected = 3 * solid_angle * (f * directions[..., 2:]).mean((0, 1))
    assert_means(image, expected, 1e-4)


def irradiance_of_map(image, normal):
    """The irradiance of a surface with this normal; each pixel is divided into 20 x 20 parts."""
    height, width = 20 * image.shape[0], 20 * image.shape[1]
    polar = (np.arange(height) + 0.5) / height * np.pi
    azimuth = np.pi - (np.arange(width) + 0.5) / width * 2 * np.pi
    polar, azimuth = np.meshgrid(polar, azimuth, indexing="ij")
    directions = np.stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], axis=-1)
    weights = np.maximum(directions @ np.asarray(normal), 0) * np.sin(polar) * (np.pi / height) * (2 * np.pi / width)
    return (weights[..., None] * image.repeat(20, axis=0).repeat(20, axis=1)).sum((0, 1))


@pytest.mark.parametrize("kind", ["noise", "one bright pixel", "black above"])
def test_irradiance_of_an_environment_is_the_integral(kind, rng):
    sky = rng.uniform(0, 1, (9, 18, 3))
    if kind == "one bright pixel":
        sky = np.full((9, 18, 3), 1e-3)
        sky[2, 5] = (300, 200, 100)
    elif kind == "black above":
        sky[:4] = 0
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    for rotation in (np.eye(3), turn):
        light = isospline.EnvironmentLight(2.0, image=sky, rotation=rotation)
        integrator = isospline.PathTracer(MATTE, lights=[light])
        image = render(isospline.Scene([FLOOR]), DOWN, size=(12, 12), light=integrator, samples=512)
        expected = 2 * 0.6 / np.pi * irradiance_of_map(sky, rotation.T @ (0, 0, 1))
        assert_means(image, expected, 1e-3)


def test_the_camera_sees_the_environment_the_right_way_round():
    sky = np.zeros((8, 16, 3))
    sky[:4, :, 2] = 1  # blue above
    sky[:, 7:9, 0] = 1  # red about x
    sky[:, 3:5, 1] = 1  # green about y
    light = isospline.EnvironmentLight(image=sky, visible=True)
    far_away = isospline.Mesh([(1e3, 1e3, 1e3), (1e3, 1e3, 1001), (1e3, 1001, 1e3)], [(0, 1, 2)])

    def seen(target, **hidden):
        camera = isospline.PerspectiveCamera((0, 0, 0), target, up=(0, 0, 1), field_of_view=2)
        integrator = isospline.PathTracer(lights=[isospline.EnvironmentLight(image=sky, **hidden)])
        scene = isospline.Scene([far_away])
        return render(scene, camera, size=(4, 4), light=integrator).color[1, 1].tolist()

    assert light.visible
    assert seen((1, 0, 0.3), visible=True) == [1, 0, 1, 1]
    assert seen((1, 0, -0.3), visible=True) == [1, 0, 0, 1]
    assert seen((0, 1, -0.3), visible=True) == [0, 1, 0, 1]
    assert seen((0, -1, 0.3), visible=True) == [0, 0, 1, 1]
    assert seen((1, 0, 0.3)) == [0, 0, 0, 0]


def test_lamps_are_seen_and_hide_each_other():
    """Two rectangles, the near one in front of half of the far one; from behind, the near one is invisible."""
    near = isospline.RectangleLight((-1, -5, 4), (0, 10, 0), (10, 0, 0), radiance=(1, 0, 0))  # shines down
    far = isospline.RectangleLight((-10, -5, 8), (0, 10, 0), (20, 0, 0), radiance=(0, 1, 0))
    black = isospline.Material(0, specular=0)
    scene = isospline.Scene([FLOOR])

    def colors(eye, target):
        camera = isospline.OrthographicCamera(eye, target, up=(0, 1, 0), height=8)
        image = render(scene, camera, size=(16, 32), light=isospline.PathTracer(black, lights=[near, far]), samples=2)
        return np.unique(image.color.reshape(-1, 4), axis=0).tolist()

    assert colors((5, 0, 1), (5, 0, 2)) == [[1, 0, 0, 1]]
    assert colors((-6.5, 0, 1), (-6.5, 0, 2)) == [[0, 1, 0, 1]]
    assert colors((5, 0, 5), (5, 0, 6)) == [[0, 1, 0, 1]]
    assert colors((5, 0, 30), (5, 0, 0)) == [[0, 0, 0, 1]]

    # A point below both gets the light of the near one, and of the part of the far one that the near one does not hide.
    image = render(
        scene,
        isospline.PerspectiveCamera((0, -40, 3), (5, 0, 0), field_of_view=0.1),
        size=(8, 8),
        light=isospline.PathTracer(MATTE, lights=[near, far]),
        samples=4096,
    )
    at = np.array([5.0, 0, 0])
    red = irradiance_of_polygon(at, (0, 0, 1), np.array([(-1, -5, 4), (-1, 5, 4), (9, 5, 4), (9, -5, 4)], float))
    whole = irradiance_of_polygon(at, (0, 0, 1), np.array([(-10, -5, 8), (-10, 5, 8), (10, 5, 8), (10, -5, 8)], float))
    # The far plane is twice as far away: there, the near one hides x in (-7, 13) and all of y.
    rest = irradiance_of_polygon(at, (0, 0, 1), np.array([(-10, -5, 8), (-10, 5, 8), (-7, 5, 8), (-7, -5, 8)], float))
    assert rest < 0.2 * whole
    expected = 0.6 / np.pi * np.array([red, rest, 0])
    assert_means(image, expected, 3e-3)


SQUARE = np.array([(-2, -1, 3), (-2, 1, 3), (2, 1, 3), (2, -1, 3)], float)
OF_SQUARE = irradiance_of_polygon(np.zeros(3), (0, 0, 1), SQUARE)


@pytest.mark.parametrize("turn, offset", [("straight", (0, 0, 0)), ("oblique", (30.7, -10.1, 5.3))])
def test_lamps_may_lie_in_a_surface(turn, offset):
    """A panel in a ceiling: it lights the floor, the camera sees it, and the other side of the ceiling is dark."""
    turn = DIRECTIONS[turn]

    def place(points):
        return np.asarray(points, float) @ turn.T + offset

    def colors(lamp, eye, target):
        camera = isospline.OrthographicCamera(place(eye), place(target), up=turn[:, 1], height=1e-3)
        light = isospline.PathTracer(MATTE, lights=[lamp], max_bounces=1)
        return render(scene, camera, size=(12, 12), light=light, samples=256)

    scene = isospline.Scene([isospline.Mesh(place(FLOOR.vertices + (0, 0, z)), FLOOR.faces) for z in (0, 3)])
    panel = isospline.RectangleLight(place(SQUARE[0]), turn @ (0, 2, 0), turn @ (4, 0, 0), radiance=2)
    assert_means(colors(panel, (0, 0, 1), (0, 0, 0)), 0.6 / np.pi * 2 * OF_SQUARE, 1e-3)
    assert (colors(panel, (0, 0, 1), (0, 0, 2)).color == (2, 2, 2, 1)).all()
    assert not colors(panel, (0, 0, 5), (0, 0, 0)).color[..., :3].any()
    point = isospline.PositionalLight(place((1, 0, 3)), intensity=10)
    assert_means(colors(point, (0, 0, 1), (0, 0, 0)), 0.6 / np.pi * 10 * 3 / 10**1.5, 1e-3)


SKIES = [isospline.EnvironmentLight(1), isospline.EnvironmentLight(image=np.ones((4, 8, 3)))]


@pytest.mark.parametrize("sky", SKIES, ids=["constant", "image"])
def test_reflected_rays_meet_what_casts_shadows(sky):
    """A square above the floor hides its part of the sky, whether the camera sees it or not, or none of it."""
    camera = isospline.OrthographicCamera((0, 0, 1), (0, 0, 0), up=(0, 1, 0), height=1e-3)
    for visible, casts_shadow in ((True, True), (False, True), (True, False)):
        scene = isospline.Scene([FLOOR])
        scene.add(isospline.Mesh(SQUARE, FLOOR.faces), visible=visible, casts_shadow=casts_shadow)
        light = isospline.PathTracer(MATTE, lights=[sky], max_bounces=1)
        image = render(scene, camera, size=(12, 12), light=light, samples=1024)
        assert_means(image, 0.6 * (1 - casts_shadow * OF_SQUARE / np.pi), 1e-3)


@pytest.mark.parametrize("side", [1, -1])
def test_normals_at_vertices_shade_the_side_of_the_face(side):
    """Lambert's law for the normals, with the light above the face alone."""
    floor = isospline.Mesh(FLOOR.vertices, FLOOR.faces, normals=[at_angle(50)] * 4)
    camera = isospline.OrthographicCamera((0, 0, 30 * side), (0, 0, 0), up=(0, 1, 0), height=1)

    def image(lamp, samples):
        light = isospline.PathTracer(MATTE, lights=[lamp], max_bounces=1)
        return render(isospline.Scene([floor]), camera, size=(12, 12), light=light, samples=samples)

    for angle in (-60, -20, 30, 80, 100):
        sun = isospline.DirectionalLight(-side * at_angle(angle), intensity=np.pi)
        expected = 0.6 * max(np.cos(np.radians(angle - 50)), 0) if angle < 90 else 0
        np.testing.assert_allclose(image(sun, 1).color[..., :3], expected, atol=1e-6)
    for sky in SKIES:
        assert_means(image(sky, 1024), 0.6 * (1 + np.cos(np.radians(50))) / 2, 1e-3)


def test_a_material_for_each_geometry():
    high = isospline.Mesh([[0, -9, 1], [9, -9, 1], [9, 9, 1], [0, 9, 1]], [[0, 1, 2], [0, 2, 3]])
    red = isospline.Material((1, 0, 0), specular=0)
    sun = isospline.DirectionalLight((0, 0, -1), intensity=np.pi)
    integrator = isospline.PathTracer(MATTE, materials={1: red}, lights=[sun], max_bounces=1)
    image = render(isospline.Scene([FLOOR, high]), DOWN, size=(16, 12), light=integrator)
    np.testing.assert_allclose(image.color[:, :8], np.broadcast_to((0.6, 0.6, 0.6, 1), (12, 8, 4)), rtol=1e-6)
    np.testing.assert_allclose(image.color[:, 8:, 0], 1, rtol=1e-6)
    assert (image.geometry_ids == np.repeat([0, 1], 8)).all()


def test_bounces_and_background():
    scene = isospline.Scene([ball()])
    camera = isospline.camera_for(scene)
    options = dict(size=(40, 30), samples=2, light=isospline.PathTracer(max_bounces=0))
    dark = render(scene, camera, **options)
    assert not dark.color[..., :3].any() and dark.color[..., 3].any()
    shown = render(scene, camera, background=linear((1, 0.5, 0.25)), **options)
    np.testing.assert_allclose(shown.color[..., :3], (1 - dark.color[..., 3:]) * (1, 0.5, 0.25), atol=1e-6)
    assert (shown.color[..., 3] == 1).all()


def test_bad_path_tracers():
    empty, integrator = isospline.Scene(), isospline.PathTracer()
    for make, parameter in (
        (lambda: isospline.Material(1.1), "color"),
        (lambda: isospline.Material(metallic=-1), "metallic"),
        (lambda: isospline.Material(roughness=np.nan), "roughness"),
        (lambda: isospline.Material(specular=2), "specular"),
        (lambda: isospline.SphereLight((0, 0, 0), 0), "radius"),
        (lambda: isospline.SphereLight((0, 0, np.inf), 1), "center"),
        (lambda: isospline.SphereLight((0, 0, 0), 1, radiance=-1), "radiance"),
        (lambda: isospline.RectangleLight((0, 0, 0), (1, 0, 0), (2, 0, 0)), "edge_v"),
        (lambda: isospline.RectangleLight((0, 0, 0), (0, 0, 0), (2, 0, 0)), "edge_u"),
        (lambda: isospline.EnvironmentLight(-1), "radiance"),
        (lambda: isospline.EnvironmentLight(image=np.zeros((3, 4))), "image"),
        (lambda: isospline.EnvironmentLight(image=np.zeros((0, 4, 3))), "image"),
        (lambda: isospline.EnvironmentLight(image=np.full((2, 4, 3), -1)), "image"),
        (lambda: isospline.EnvironmentLight(rotation=np.diag([1, 1, -1])), "rotation"),
        (lambda: isospline.PathTracer(max_bounces=-1), "max_bounces"),
        (lambda: isospline.PathTracer(lights=[isospline.EnvironmentLight()] * 2), "lights"),
        (lambda: render(empty, DOWN, samples=0, light=integrator), "samples"),
        (lambda: render(empty, DOWN, size=(0, 4), light=integrator), "size"),
        (lambda: render(empty, DOWN, background=-1, light=integrator), "background"),
    ):
        with pytest.raises(ValueError, match=f"^{parameter}: expected .* got "):
            make()
