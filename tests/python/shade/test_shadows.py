"""Hard shadows and ambient occlusion against closed forms."""

import functools

import numpy as np
import pytest
import scipy.ndimage
from layered import render

import isospline
from isospline.colors import linear

RADIUS = 6.3
CENTER = np.array([1.0, 2.0, 9.0])
SIZE = (160, 120)
FLOOR = isospline.Mesh([[-40, -40, 0], [40, -40, 0], [40, 40, 0], [-40, 40, 0]], [[0, 1, 2], [0, 2, 3]])
CAMERA = isospline.PerspectiveCamera((4, -45, 60), (2, 0, 0), field_of_view=40)


def ball(center=CENTER):
    """f = |x - center|^2; a quadratic model holds it exactly outside the reach of the boundary rule."""
    z, y, x = np.mgrid[-16:17, -16:17, -16:17].astype(float)
    volume = isospline.Volume(x**2 + y**2 + z**2, origin=center - 16)
    return isospline.Isosurface(volume, RADIUS**2, inside="below")


def dot(a, b):
    return (a * b).sum(-1, keepdims=True)


def misses_ball(positions, directions):
    """The distance of half-lines from the ball's surface; negative if they hit the ball."""
    directions = directions / np.linalg.norm(directions, axis=-1, keepdims=True)
    along = np.maximum(dot(CENTER - positions, directions), 0)
    return np.linalg.norm(positions + along * directions - CENTER, axis=-1) - RADIUS


LIGHTS = {
    "positional": (isospline.PositionalLight((-5, 8, 40)), lambda at: np.array((-5, 8, 40.0)) - at),
    "directional": (isospline.DirectionalLight((0.3, 0.2, -1)), lambda at: -np.array((0.3, 0.2, -1.0)) + 0 * at),
    "below the ball": (isospline.PositionalLight((0, 0, 1.0)), lambda at: np.array((0, 0, 1.0)) - at),
}


@pytest.mark.parametrize("light, to_light", LIGHTS.values(), ids=LIGHTS)
def test_a_ball_casts_its_shadow_on_a_floor(light, to_light):
    scene = isospline.Scene([FLOOR, ball()])
    flat = dict(ambient=0, diffuse=1, specular=0, lights=[light])
    shadowed, plain = (
        render(scene, CAMERA, size=SIZE, light=isospline.Phong(**flat, shadows=shadows)) for shadows in (True, False)
    )
    position = plain.position.astype(float)
    direction = to_light(position)
    below = light is LIGHTS["below the ball"][0]  # an object behind the light casts no shadow
    clearance = np.full(position.shape[:2], np.inf) if below else misses_ball(position, direction)
    on_floor = plain.geometry_ids == 0
    clear = on_floor & (np.abs(clearance) > 1e-3)
    lit = clear & (clearance > 0)
    assert lit.sum() > 5000 and (below or (clear & ~lit).sum() > 200)
    np.testing.assert_array_equal(shadowed.color[lit], plain.color[lit])
    assert not shadowed.color[clear & ~lit][:, :3].any()

    # The ball shadows only its own far side, which Phong leaves dark anyway.
    on_ball = plain.geometry_ids == 1
    facing = dot(plain.normal, direction)[..., 0] / np.linalg.norm(direction, axis=-1)
    assert on_ball.sum() > 500
    np.testing.assert_array_equal(shadowed.color[on_ball & (facing > 1e-4)], plain.color[on_ball & (facing > 1e-4)])


@pytest.mark.sweep(1)
@pytest.mark.parametrize("samples, rays, bound", [(1024, 1, 6e-3), (1, 1, 0.35), (1, 64, 0.04)])
def test_the_shadow_of_a_disc_of_light_is_its_hidden_part(samples, rays, bound):
    """A ball hides directions within asin(radius / distance); the light's are uniform on a cap of the sphere."""
    light = isospline.DirectionalLight((0.3, 0.2, -1), intensity=0.8, angle=30)
    shading = isospline.Phong(ambient=0, diffuse=1, specular=0, lights=[light], shadows=True, shadow_samples=samples)
    image = render(isospline.Scene([FLOOR, ball()]), CAMERA, size=(60, 45), light=shading, samples=rays)
    plain = render(isospline.Scene([FLOOR]), CAMERA, size=(60, 45), light=shading.replace(shadows=False))
    to_light = -np.array(light.direction) / np.linalg.norm(light.direction)
    # Directions by rejection from the sphere, independent of the renderer's map of a square.
    drawn = np.random.default_rng(5).normal(size=(400_000, 3))
    drawn /= np.linalg.norm(drawn, axis=1, keepdims=True)
    cap = drawn[drawn @ to_light > np.cos(np.radians(15))]
    assert len(cap) > 5000
    on_floor = scipy.ndimage.binary_erosion(image.geometry_ids == 0)
    to_ball = CENTER - image.position[on_floor].astype(float)
    distance = np.linalg.norm(to_ball, axis=-1, keepdims=True)
    is_hidden = (to_ball / distance) @ cap.T > np.sqrt(1 - (RADIUS / distance) ** 2)
    expected = plain.color[on_floor][:, 0] * (1 - is_hidden.mean(axis=1))
    assert (is_hidden.mean(axis=1) > 0.99).any() and ((expected > 0.1) & (expected < 0.6)).sum() > 20
    error = np.abs(image.color[on_floor][:, 0] - expected)
    assert np.sqrt((error**2).mean()) < bound
    assert abs((image.color[on_floor][:, 0] - expected).mean()) < 0.004


@pytest.mark.parametrize("angle", [-1.0, 180.5, np.nan])
def test_angles_of_lights_are_checked(angle):
    with pytest.raises(ValueError, match="^angle: expected degrees from 0 to 180, got"):
        isospline.DirectionalLight((0, 0, 1), angle=angle)


def test_numbers_of_shadow_rays_are_checked():
    for samples in (0, 65537):
        with pytest.raises(ValueError, match="^shadow_samples: expected rays a hit, from 1 to 65536, got"):
            isospline.Phong(shadow_samples=samples)


def test_a_mesh_casts_its_shadow_on_an_isosurface():
    """A square above the ball, seen from above and behind it, under a light straight above."""
    square = np.array([[-2, -2, 0], [2, -2, 0], [2, 2, 0], [-2, 2, 0]]) + CENTER + (0, 0, 30)
    scene = isospline.Scene([isospline.Mesh(square, [[0, 1, 2], [0, 2, 3]]), ball()])
    camera = isospline.PerspectiveCamera(CENTER + (0, -25, 25), CENTER, field_of_view=35)
    lights = [isospline.DirectionalLight((0, 0, -1))]
    shading = isospline.Phong(ambient=0.25, diffuse=0, specular=1, specular_exponent=0, shadows=True, lights=lights)
    image = render(scene, camera, size=SIZE, light={1: shading})
    offset = np.abs(image.position - CENTER)[..., :2].max(-1)
    to_viewer = np.array(camera.eye) - image.position
    reflected = 2 * image.normal * image.normal[..., 2:] - (0, 0, 1)
    seen = (image.geometry_ids == 1) & (dot(to_viewer, reflected)[..., 0] > 1e-2) & (np.abs(offset - 2) > 1e-3)
    expected = np.where(offset < 2, 0.25, 1.25)[seen]
    assert 200 < (expected < 1).sum() < len(expected)
    np.testing.assert_array_equal(image.color[seen, 0], expected.astype(np.float32))


def test_openness_below_a_ball_is_the_closed_form():
    """A ball above the horizon covers cos(angle to its centre) (radius / distance)^2 of an even sky."""
    scene = isospline.Scene([FLOOR, ball()])
    color = np.array((0.9, 0.6, 0.3))
    model = isospline.AmbientOcclusion(1024, color=linear(color))
    image = render(scene, CAMERA, size=(60, 45), light=model)
    offset = CENTER - image.position
    distance = np.linalg.norm(offset, axis=-1)
    covered = offset[..., 2] / distance * (RADIUS / distance) ** 2
    on_floor = image.geometry_ids == 0
    np.testing.assert_allclose(image.color[on_floor][:, :3], (1 - covered[on_floor])[:, None] * color, atol=8e-3)
    assert covered[on_floor].max() > 0.4
    # The floor is below the horizon of the ball's upper half.
    upper = (image.geometry_ids == 1) & (image.normal[..., 2] >= 0)
    np.testing.assert_allclose(image.color[upper][:, :3].max(0), color, rtol=1e-6)

    near = isospline.AmbientOcclusion(64, distance=2.0)
    image = render(scene, CAMERA, size=(60, 45), light=near)
    assert (image.color[on_floor] == 1).all()


def test_openness_outside_and_inside_of_a_ball():
    outside = isospline.PerspectiveCamera(CENTER + (0, -40, 0), CENTER)
    inside = isospline.PerspectiveCamera(CENTER, CENTER + (0, 1, 0), field_of_view=90)
    scene = isospline.Scene([ball()])
    for camera, openness in ((outside, 1.0), (inside, 0.0)):
        image = render(scene, camera, size=(80, 60), light=isospline.AmbientOcclusion(16))
        hit = image.geometry_ids == 0
        assert hit.sum() > 1000
        assert (image.color[hit][:, :3] == openness).all()


RAMP = linear([(1, 0, 0), (0, 1, 0.5)])
ALONG_X = isospline.Volume(np.broadcast_to(np.linspace(0, 1, 60), (60, 60, 60)).copy(), origin=(-30, -30, -10))
COLORS = [
    isospline.ColorByNormal(),
    isospline.ColorByDepth(RAMP),
    isospline.ColorByCurvature("mean", RAMP, limits=(-0.5, 0.5)),
    isospline.ColorByVolume(ALONG_X, RAMP),
]


@pytest.mark.parametrize("color", COLORS, ids=lambda color: type(color).__name__)
def test_what_is_hidden_does_not_depend_on_colors(color):
    """A surface's colour is a factor of its diffuse light and of the light of an even sky, with any occluders."""
    corners = np.array([(0.2, 0.4, 0.8), (1, 1, 1), (0.5, 0.1, 0.3), (0.9, 0.6, 0)])
    floor = isospline.Mesh(FLOOR.vertices, FLOOR.faces, colors=linear(corners))
    lights = [isospline.PositionalLight((-5, 8, 40)), isospline.DirectionalLight((0.3, 0.2, -1), intensity=0.5)]
    matte = dict(ambient=0.1, diffuse=0.7, specular=0, lights=lights, shadows=True)

    for make in (functools.partial(isospline.Phong, **matte), functools.partial(isospline.AmbientOcclusion, 8)):
        plain, colored = (
            render(isospline.Scene([mesh, ball()]), CAMERA, size=SIZE, light=make(color=of_surface))
            for mesh, of_surface in ((FLOOR, 1.0), (floor, color))
        )
        surfaces = plain.geometry_ids != isospline.INVALID_ID
        assert len(np.unique(plain.color[surfaces, 0])) > 5 and np.ptp(colored.albedo[surfaces], axis=0).min() > 0.2
        expected = plain.color[surfaces, :3] * colored.albedo[surfaces]
        np.testing.assert_allclose(colored.color[surfaces, :3], expected, atol=1e-6)


def test_threads_do_not_change_shadows_and_occlusion():
    scene = isospline.Scene([FLOOR, ball()])
    shading = {0: isospline.AmbientOcclusion(8), 1: isospline.Phong(shadows=True)}
    images = []
    try:
        for threads in (1, 2):
            isospline.set_thread_count(threads)
            images.append(render(scene, CAMERA, size=(101, 83), light=shading, samples=2).color.tobytes())
    finally:
        isospline.set_thread_count(0)
    assert images[0] == images[1]


@pytest.mark.parametrize(
    "make, parameter",
    [
        (lambda: isospline.AmbientOcclusion(0), "samples"),
        (lambda: isospline.AmbientOcclusion(4, distance=0), "distance"),
        (lambda: isospline.AmbientOcclusion(4, distance=np.nan), "distance"),
        (lambda: isospline.AmbientOcclusion(4, color=-1), "color"),
    ],
)
def test_bad_ambient_occlusion(make, parameter):
    with pytest.raises(ValueError, match=f"^{parameter}: expected .* got "):
        make()
