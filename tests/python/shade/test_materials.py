"""Colours and owners of the materials of path traced objects."""

import numpy as np
import pytest
from layered import render

import isospline
from isospline.colors import linear

SIZE = (80, 60)
RADIUS, SCALE = 5.0, 1.5
RAMP = linear([(0.1, 0.9, 0.3), (0.8, 0.2, 0.4)])
SQUARE = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0.0)])
FACES = [(0, 1, 2), (0, 2, 3)]
DOWN = isospline.OrthographicCamera((0, 0, 30), (0, 0, 0), up=(0, 1, 0), height=12)


def matte(color):
    return isospline.Material(color, specular=0)


def ramp(part):
    return RAMP[0] + np.asarray(part)[..., None] * np.subtract(RAMP[1], RAMP[0])


def linear_volume():
    """f = x, which is a spline of degree 1."""
    x = np.arange(-12.0, 13.0)
    return isospline.Volume(np.broadcast_to(x, (25, 25, 25)).copy(), origin=(-12, -12, -12), degree=1)


RULES = {
    "normal": isospline.ColorByNormal(),
    "depth": isospline.ColorByDepth(RAMP),
    "volume": isospline.ColorByVolume(linear_volume(), RAMP, limits=(-10, 10)),
    "mean curvature": isospline.ColorByCurvature("mean", RAMP, limits=(-0.1, 0.4)),
    "gaussian curvature": isospline.ColorByCurvature("gaussian", RAMP, limits=(-0.02, 0.05)),
    "ridges": isospline.ridges_and_valleys(0.5, color=linear(0.5)),
}


@pytest.fixture(scope="module")
def ball():
    """A convex scene: in even light, the reflected light is exactly the colour (Lambert's law)."""
    z, y, x = np.mgrid[-12:13, -12:13, -12:13].astype(float)
    volume = isospline.Volume(x**2 + y**2 + z**2, origin=(-12, -12, -12))
    scene = isospline.Scene()
    scene.add(isospline.Isosurface(volume, RADIUS**2, inside="below"), np.diag([SCALE, SCALE, SCALE, 1]))
    return scene


CAMERA = isospline.OrthographicCamera((0, -40, 0), (0, 0, 0), height=20)


def expected_color(name, image, bounds):
    """Closed forms of the ball's colours."""
    if name == "normal":
        return 0.5 * (image.position / (RADIUS * SCALE) + 1)
    if name == "depth":  # between the nearest and the farthest depth of the scene's box
        lower, upper = 40 + bounds[:, 1]
        return ramp((image.depth - lower) / (upper - lower))
    if name == "volume":
        return ramp((image.position[..., 0] + 10) / 20)
    if name == "ridges":  # 0.5 to 1 over mean curvatures of 0 to 0.5
        return np.full(image.position.shape, 0.5 + 1 / (RADIUS * SCALE))
    mean, gaussian = 1 / (RADIUS * SCALE), 1 / (RADIUS * SCALE) ** 2
    part = (mean + 0.1) / 0.5 if name == "mean curvature" else (gaussian + 0.02) / 0.07
    return np.broadcast_to(ramp(part), image.position.shape)


@pytest.mark.parametrize("name", RULES)
def test_base_colors_follow_from_the_point(ball, name):
    color = RULES[name]
    integrator = isospline.PathTracer(matte(color))
    image = render(ball, CAMERA, size=SIZE, light=integrator, samples=16)
    phong = render(ball, CAMERA, size=SIZE, light=isospline.Phong(color=color))
    np.testing.assert_array_equal(image.albedo, phong.albedo)

    # Away from the silhouette, the samples of a pixel see about the same colour as its centre.
    inner = image.normal[..., 1] < -0.6
    assert inner.sum() > 500
    np.testing.assert_allclose(image.color[inner][:, :3], image.albedo[inner], atol=0.01)
    np.testing.assert_allclose(image.albedo[inner], expected_color(name, image, ball.bounds)[inner], atol=2e-4)


def test_every_hit_of_a_path_has_its_base_color():
    """A linear volume and equal colours at vertices give the same picture, including light between surfaces."""
    corner = np.concatenate([8 * SQUARE, 8 * SQUARE[:, [2, 0, 1]] - (8, 0, -8), 8 * SQUARE[:, [1, 2, 0]] + (0, 8, 8)])
    faces = np.concatenate([np.add(FACES, first) for first in (0, 4, 8)])
    lights = [isospline.SphereLight((3, -3, 7), 1, radiance=20), isospline.EnvironmentLight(0.2)]
    camera = isospline.PerspectiveCamera((30, -30, 25), (0, 0, 4), field_of_view=30)
    images = []
    for color, vertex_colors in ((RULES["volume"], None), (1.0, linear(ramp((corner[:, 0] + 10) / 20)))):
        scene = isospline.Scene([isospline.Mesh(corner, faces, colors=vertex_colors)])
        integrator = isospline.PathTracer(matte(color), lights=lights, max_bounces=2)
        images.append(render(scene, camera, size=SIZE, light=integrator, samples=4, layers=("direct",)))
    by_volume, at_vertices = images
    assert (by_volume.color[..., 0] > 1.2 * by_volume.direct[..., 0]).mean() > 0.1  # there is indirect light
    np.testing.assert_allclose(by_volume.color, at_vertices.color, atol=1e-5)
    np.testing.assert_allclose(by_volume.albedo, at_vertices.albedo, atol=1e-6)


def test_colors_at_vertices_do_not_make_light():
    with pytest.raises(ValueError, match="^colors: expected numbers from 0 to 1 .* got "):
        isospline.Mesh(9 * SQUARE, FACES, colors=np.full((4, 3), 3.0))


def test_a_color_rule_has_no_scattering_function():
    material = isospline.Material(isospline.ColorByNormal())
    assert isinstance(material.color, isospline.ColorByNormal) and "ColorByNormal()" in repr(material)
    with pytest.raises(ValueError, match="^color: expected a constant colour, .* got ColorByNormal"):
        material.evaluate((0, 0, 1), (0, 0, 1))


def test_materials_of_geometries_come_before_those_of_objects_before_the_default():
    red, green, blue = (matte(color) for color in np.eye(3))
    own = isospline.Mesh(SQUARE, FACES, material=green)
    bare = isospline.Mesh(SQUARE, FACES)
    assert own.material == green and bare.material is None
    scene = isospline.Scene()
    for x, mesh in ((-3, bare), (-1, own), (1, own), (3, bare)):
        move = np.eye(4)
        move[0, 3] = x
        scene.add(mesh, move)
    camera = isospline.OrthographicCamera((0, 0, 30), (0, 0, 0), up=(0, 1, 0), height=2)
    integrator = isospline.PathTracer(red, materials={2: blue, 3: matte(linear(0.5))})
    image = render(scene, camera, size=(16, 4), light=integrator)
    expected = np.array([(1, 0, 0), (0, 1, 0), (0, 0, 1), (0.5, 0.5, 0.5)]).repeat(4, axis=0)
    for layer in (image.albedo, image.color[..., :3]):
        np.testing.assert_allclose(layer, np.broadcast_to(expected, (4, 16, 3)), atol=1e-6)


def test_isosurfaces_carry_materials():
    field = isospline.volumes.sphere(0.5)
    volume = field.volume(16)
    green = matte((0, 1, 0))
    surface = isospline.Isosurface(volume, field.level, material=green)
    assert surface.material == green and surface.with_level(field.level + 0.1).material == green
    assert isospline.Isosurface(volume, field.level).material is None

    scene = isospline.Scene()
    renderer = isospline.ProgressiveRenderer(
        scene, isospline.camera_for(isospline.Scene([surface])), size=(16, 12), layers=("albedo", "geometry_ids")
    )
    renderer.step()
    scene.add(surface)
    renderer.reset()
    renderer.step()
    hit = renderer.image.geometry_ids == 0
    assert hit.sum() > 20 and (renderer.image.albedo[hit] == (0, 1, 0)).all()


@pytest.mark.parametrize("cap_color", [linear((0.2, 0.4, 0.6)), RULES["volume"], isospline.ColorByDepth(RAMP), None])
def test_capped_cuts_have_a_color_of_their_own(cap_color):
    """Half a ball in even light; it is convex, like the whole ball."""
    z, y, x = np.mgrid[-12:13, -12:13, -12:13].astype(float)
    volume = isospline.Volume(x**2 + y**2 + z**2, origin=(-12, -12, -12))
    half = isospline.HalfSpace((0, 0, 0), (0, 1, 0))
    surface = isospline.Isosurface(volume, 36.0, inside="below", clip=half, capped=True)
    scene = isospline.Scene([surface])
    camera = isospline.PerspectiveCamera((15, -30, 8), (0, 0, 0), field_of_view=28)
    material = isospline.Material(isospline.ColorByNormal(), specular=0, cap_color=cap_color)
    image = render(scene, camera, size=SIZE, light=isospline.PathTracer(material), samples=4)
    shading = isospline.Phong(color=isospline.ColorByNormal(), cap_color=cap_color)
    plain = render(scene, camera, size=SIZE, light=shading)
    np.testing.assert_array_equal(image.albedo, plain.albedo)
    axis_distance = np.hypot(*np.moveaxis(image.position, -1, 0)[[0, 2]])
    cap = (image.primitive_ids == surface.volume.cell_count) & (axis_distance < 5.5)
    assert cap.sum() > 300
    np.testing.assert_allclose(image.color[cap][:, :3], image.albedo[cap], atol=0.02)
    if cap_color is None:
        np.testing.assert_allclose(image.albedo[cap], np.broadcast_to((0.5, 0, 0.5), (cap.sum(), 3)), atol=1e-6)
    elif isinstance(cap_color, np.ndarray):
        np.testing.assert_allclose(image.color[cap][:, :3], np.broadcast_to(cap_color, (cap.sum(), 3)), rtol=1e-6)


def test_bad_materials():
    mesh = isospline.Mesh(SQUARE, FACES)
    scene = isospline.Scene([mesh])
    for make in (
        lambda: render(scene, DOWN, light=isospline.PathTracer(materials={1: isospline.Material()})),
        lambda: isospline.PathTracer(material=isospline.Material(), materials={0: isospline.Material(1.5)}),
        lambda: isospline.Material(isospline.ColorByCurvature(limits=(1, 1))),
        lambda: isospline.Material((0.5, 0.5)),
        lambda: isospline.Material(cap_color=2),
    ):
        with pytest.raises(ValueError, match=r"^(materials|color|cap_color|limits): expected .* got "):
            make()
    for make in (
        lambda: isospline.Mesh(SQUARE, FACES, material="red"),
        lambda: isospline.Isosurface(linear_volume(), 0.0, material=(1, 0, 0)),
    ):
        with pytest.raises(TypeError):
            make()
