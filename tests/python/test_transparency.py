"""Translucent surfaces against closed forms, and against the over operator on all crossings in NumPy."""

import numpy as np
import pytest
from layered import render

import isospline

OUTER, INNER = 6.3, 3.7
SIZE = (120, 90)
CAMERA = isospline.PerspectiveCamera((4, -25, 9), (0, 0, 0), field_of_view=40)
LIGHTS = [isospline.PositionalLight((10, -20, 15), intensity=(1, 0.9, 0.8)), isospline.DirectionalLight((1, 0.5, -2))]
FLOOR = isospline.Mesh([[-40, -40, -8], [40, -40, -8], [40, 40, -8], [-40, 40, -8]], [[0, 1, 2], [0, 2, 3]])
#: Of the corners of a triangle through both balls.
BLADE_COLORS = np.array([(1, 0, 0), (0, 1, 0), (0.2, 0.3, 1)])
BLADE = isospline.Mesh([[-9, -1, -7], [9, 1, -6], [1, 2, 12]], [[0, 1, 2]], colors=BLADE_COLORS)


def ball(radius, center=(0, 0, 0)):
    """f = |x - center|^2, which a quadratic model holds exactly where the boundary rule does not reach."""
    z, y, x = np.mgrid[-16:17, -16:17, -16:17].astype(float)
    volume = isospline.Volume(x**2 + y**2 + z**2, origin=np.array(center) - 16.0)
    return isospline.Isosurface(volume, radius**2, inside="below")


def dot(a, b):
    return (a * b).sum(-1, keepdims=True)


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def over(layers, opaque_from):
    """Colours (..., 3) and alpha of layers (colour, opacity, whether it is there), from front to back."""
    color, transmittance = np.zeros((*opaque_from, 3)), np.ones(opaque_from)
    for layer, opacity, there in layers:
        opacity = np.where(there, opacity, 0.0)
        color += (transmittance * opacity)[..., None] * np.where(there[..., None], layer, 0.0)
        transmittance *= 1 - opacity
    return color, 1 - transmittance


def roots(rays, radius):
    """t of both crossings of a ball about the origin, NaN where there are none; and the discriminant."""
    origin, direction = rays[..., :3], unit(rays[..., 3:])
    b = dot(origin, direction)[..., 0]
    discriminant = b**2 - (origin**2).sum(-1) + radius**2
    root = np.sqrt(np.where(discriminant > 0, discriminant, np.nan))
    return -b - root, -b + root, discriminant


def test_nested_balls_are_the_closed_form():
    """Front and back of the outer ball, the opaque inner ball's front, and a background that shows through the rest."""
    scene = isospline.Scene([ball(OUTER), ball(INNER)])
    shell, core = 0.3, np.array((0.9, 0.6, 0.2))
    shading = {
        0: isospline.Outline(2, color=(0.2, 0.5, 1), surface_color=(0.1, 0, 0.05), opacity=shell),
        1: isospline.Outline(1, color=0, surface_color=core),
    }
    background = np.array((0.4, 0.3, 0.2))
    image = render(scene, CAMERA, size=SIZE, shading=shading, background=background)

    rays = CAMERA.rays(SIZE)
    direction = unit(rays[..., 3:])
    front, back, outer = roots(rays, OUTER)
    core_front, _, inner = roots(rays, INNER)

    def outline(t, radius, exponent, color, surface_color):
        cosine = dot((rays[..., :3] + t[..., None] * direction) / radius, direction)
        intensity = (1 - cosine**2) ** exponent
        return intensity * np.array(color) + (1 - intensity) * np.array(surface_color)

    skin = ((0.2, 0.5, 1), (0.1, 0, 0.05))
    layers = [
        (outline(front, OUTER, 2, *skin), shell, outer > 0),
        (outline(core_front, INNER, 1, (0, 0, 0), core), 1.0, inner > 0),
        (outline(back, OUTER, 2, *skin), shell, outer > 0),
    ]
    color, alpha = over(layers, outer.shape)
    clear = (np.abs(outer) > 0.5) & (np.abs(inner) > 0.5)
    assert (clear & (inner > 0)).sum() > 800 and (clear & (outer > 0) & (inner < 0)).sum() > 800
    expected = color + (1 - alpha)[..., None] * background
    assert np.abs(image.color[..., :3] - expected)[clear].max() < 2e-5
    np.testing.assert_allclose(image.color[..., 3], 1, rtol=1e-6)

    alone = render(scene, CAMERA, size=SIZE, shading=shading)
    np.testing.assert_allclose(alone.color[clear, 3], alpha[clear], atol=1e-6)


MODELS = [
    dict(color=(0.9, 0.6, 0.3), ambient=0.15, diffuse=0.55, specular=0.35, specular_exponent=12, opacity=0.35),
    dict(color=(0.2, 0.7, 0.4), ambient=0.05, diffuse=0.8, specular=0.1, specular_exponent=5, opacity=0.6),
    dict(color=(1.0, 0.9, 0.8), ambient=0.1, diffuse=0.7, specular=0.0, specular_exponent=1, opacity=0.5),
    dict(color=(0.8, 0.8, 0.8), ambient=0.2, diffuse=0.6, specular=0.2, specular_exponent=9, opacity=1.0),
]


def everything(order=(0, 1, 2, 3)):
    """Two balls, the blade in both of them, and an opaque floor, added in some order; and the models by id."""
    objects = [ball(OUTER), ball(INNER, (1, 2, 0.5)), BLADE, FLOOR]
    scene = isospline.Scene([objects[i] for i in order])
    return scene, {geometry: MODELS[i] for geometry, i in enumerate(order)}


def phongs(models, **options):
    return {geometry: isospline.Phong(lights=LIGHTS, **model, **options) for geometry, model in models.items()}


def attenuation(scene, models, position, normal, geometry_ids, primitive_ids, direction, t_far):
    """What the crossings between points and a light leave of it, and how many there are."""
    rays = np.concatenate([position - direction, direction], axis=-1)
    ids = dict(geometry_ids=geometry_ids, primitive_ids=primitive_ids)
    hits = dict(t_hit=np.ones(len(rays)), primitive_normals=normal, **ids)
    crossings = scene.list_intersections(scene.secondary_rays(rays, hits, direction), t_far=t_far)
    opacity = np.array([models[geometry]["opacity"] for geometry in crossings["geometry_ids"]])
    result = np.ones(len(rays))
    np.multiply.at(result, crossings["ray_ids"], 1 - opacity)
    return result, np.diff(crossings["ray_splits"])


@pytest.mark.parametrize("shadows", [False, True])
def test_pictures_are_the_over_operator_on_all_crossings(shadows):
    scene, models = everything()
    image = render(scene, CAMERA, size=SIZE, shading=phongs(models, shadows=shadows))

    # The paper's illumination model at every crossing.
    rays = CAMERA.rays(SIZE).reshape(-1, 6)
    crossings = scene.list_intersections(rays)
    geometry, primitive = crossings["geometry_ids"], crossings["primitive_ids"]
    position, outward = crossings["positions"], crossings["primitive_normals"]
    to_viewer = -unit(rays[crossings["ray_ids"], 3:])
    normal = np.where(dot(outward, to_viewer) < 0, -outward, outward)
    of = {name: np.array([models[i][name] for i in range(4)])[geometry] for name in MODELS[0]}
    albedo = of["color"].copy()
    u, v = crossings["primitive_uvs"].astype(float).T[:, :, None]
    blade = (1 - u - v) * BLADE_COLORS[0] + u * BLADE_COLORS[1] + v * BLADE_COLORS[2]
    albedo[geometry == 2] *= blade[geometry == 2]
    color = of["ambient"][:, None] * albedo
    most = 0
    for light in LIGHTS:
        at = isinstance(light, isospline.PositionalLight)
        offset = light.position - position if at else -light.direction + 0 * position
        lit = np.ones(len(position))
        if shadows:
            t_far = 1.0 if at else np.inf
            lit, count = attenuation(scene, models, position, outward, geometry, primitive, offset, t_far)
            most = max(most, count.max())
        to_light = unit(offset)
        reflected = 2 * normal * dot(normal, to_light) - to_light
        diffuse = of["diffuse"][:, None] * np.maximum(dot(normal, to_light), 0) * albedo
        specular = of["specular"] * np.maximum(dot(to_viewer, reflected)[:, 0], 0) ** of["specular_exponent"]
        color += lit[:, None] * light.intensity * (diffuse + specular[:, None])
    assert not shadows or most >= 4

    expected = np.zeros((len(rays), 4))
    for ray, (begin, end) in enumerate(zip(crossings["ray_splits"], crossings["ray_splits"][1:])):
        transmittance = 1.0
        for layer in range(begin, end):
            opacity = of["opacity"][layer]
            expected[ray, :3] += transmittance * opacity * color[layer]
            transmittance *= 1 - opacity
        expected[ray, 3] = 1 - transmittance
    layers = np.diff(crossings["ray_splits"])
    assert (layers >= 6).sum() > 500 and (layers == 2).sum() > 500 and (layers == 1).sum() > 500
    # A shadow's edge may lie on either side of a crossing that a mesh's rounding to single precision moves.
    wrong = np.abs(image.color.reshape(-1, 4) - expected).max(-1) > 2e-5
    assert wrong.sum() <= (3 if shadows else 0)


def test_ids_and_threads_do_not_matter():
    pictures = []
    try:
        for order, threads in (((0, 1, 2, 3), 1), ((0, 1, 2, 3), 2), ((3, 1, 0, 2), 2), ((2, 3, 1, 0), 0)):
            isospline.set_thread_count(threads)
            scene, models = everything(order)
            image = render(scene, CAMERA, size=(101, 83), shading=phongs(models, shadows=True), samples=2)
            pictures.append((image.color.tobytes(), image.depth.tobytes(), image.normal.tobytes()))
    finally:
        isospline.set_thread_count(0)
    assert all(picture == pictures[0] for picture in pictures)


@pytest.mark.parametrize("shadows", [False, True])
def test_what_is_opaque_is_as_ever(shadows):
    """A translucent object out of sight, and one behind an opaque one, leave every bit of the picture as it was."""
    opaque = isospline.Phong(color=(0.9, 0.6, 0.3), lights=LIGHTS, shadows=shadows)
    objects = [ball(OUTER), FLOOR]
    aside, within = ball(2.0, (300, 0, 0)), ball(2.0)
    pictures = [
        render(isospline.Scene(objects), CAMERA, size=SIZE, shading=opaque, samples=2),
        render(
            isospline.Scene([*objects, aside, within]),
            CAMERA,
            size=SIZE,
            shading={0: opaque, 1: opaque, 2: isospline.Phong(opacity=0.5), 3: isospline.Outline(opacity=0)},
            samples=2,
        ),
    ]
    for name in ("color", "depth", "position", "normal", "albedo", "geometry_ids", "primitive_ids"):
        before, after = (getattr(picture, name) for picture in pictures)
        np.testing.assert_array_equal(before, after, err_msg=name)


@pytest.mark.parametrize("shadows", [False, True])
def test_opacity_zero_is_as_if_it_were_not_there(shadows):
    scene, models = everything()
    shading = phongs(models, shadows=shadows)
    shading[0] = isospline.Phong(opacity=0.0)
    shading[2] = isospline.AmbientOcclusion(opacity=0.0)
    image = render(scene, CAMERA, size=SIZE, shading=shading)
    without = isospline.Scene()
    for geometry, added in ((0, BLADE), (1, ball(INNER, (1, 2, 0.5))), (2, BLADE), (3, FLOOR)):
        assert without.add(added) == geometry
    without.remove(0)
    without.remove(2)
    shading = phongs({1: MODELS[1], 3: MODELS[3]}, shadows=shadows)
    expected = render(without, CAMERA, size=SIZE, shading=shading)
    np.testing.assert_array_equal(image.geometry_ids, expected.geometry_ids)
    np.testing.assert_allclose(image.color, expected.color, atol=2e-6)
    np.testing.assert_allclose(image.depth, expected.depth, rtol=1e-6)
    np.testing.assert_allclose(image.normal, expected.normal, atol=1e-6)


def test_all_but_colour_is_of_the_first_surface():
    scene, models = everything()
    translucent = render(scene, CAMERA, size=SIZE, shading=phongs(models), layers=("curvature",))
    opaque = {geometry: dict(model, opacity=1.0) for geometry, model in models.items()}
    expected = render(scene, CAMERA, size=SIZE, shading=phongs(opaque), layers=("curvature",))
    np.testing.assert_array_equal(translucent.geometry_ids, expected.geometry_ids)
    assert len(np.unique(expected.geometry_ids)) >= 4
    for name in ("depth", "position", "normal", "albedo", "gradient_magnitude", "curvature"):
        np.testing.assert_allclose(getattr(translucent, name), getattr(expected, name), rtol=1e-5, atol=1e-6)


def test_light_on_a_floor_below_a_translucent_ball():
    """A beam that goes through the ball crosses it twice; visibility decides whether it casts a shadow at all."""
    opacity = 0.4
    flat = dict(ambient=0, diffuse=1, specular=0, lights=[isospline.DirectionalLight((0, 0, -1))], shadows=True)
    shading = {0: isospline.Phong(**flat), 1: isospline.Phong(**flat, opacity=opacity)}
    scene = isospline.Scene([FLOOR, ball(OUTER)])
    camera = isospline.PerspectiveCamera((20, 0, -3), (0, 0, -8), field_of_view=40)
    for seen, reaching in ((True, (1 - opacity) ** 2), (False, 1.0)):
        scene.set_visibility(1, shadow=seen)
        image = render(scene, camera, size=SIZE, shading=shading)
        radius = np.linalg.norm(image.position[..., :2], axis=-1)
        on_floor = (image.geometry_ids == 0) & (np.abs(radius - OUTER) > 1e-3)
        expected = np.where(radius < OUTER, reaching, 1.0)[on_floor]
        assert 100 < (expected < 1).sum() < 4000 or not seen
        np.testing.assert_allclose(image.color[on_floor, 0], expected, rtol=1e-6)


def test_openness_below_a_translucent_ball():
    """The closed form of an opaque ball, times what two crossings absorb."""
    opacity = 0.4
    center = np.array([1.0, 2.0, 1.0])
    scene = isospline.Scene([FLOOR, ball(OUTER, center)])
    shading = {0: isospline.AmbientOcclusion(1024), 1: isospline.AmbientOcclusion(1, opacity=opacity)}
    camera = isospline.PerspectiveCamera((4, -45, 60), (2, 0, -8), field_of_view=40)
    image = render(scene, camera, size=(60, 45), shading=shading)
    offset = center - image.position
    distance = np.linalg.norm(offset, axis=-1)
    covered = offset[..., 2] / distance * (OUTER / distance) ** 2
    on_floor = image.geometry_ids == 0
    assert covered[on_floor].max() > 0.2
    expected = 1 - covered[on_floor] * (1 - (1 - opacity) ** 2)
    np.testing.assert_allclose(image.color[on_floor, 0], expected, atol=8e-3)


@pytest.mark.parametrize("model", [isospline.Phong, isospline.Outline, isospline.AmbientOcclusion])
@pytest.mark.parametrize("opacity", [-0.1, 1.1, np.nan])
def test_bad_opacity(model, opacity):
    assert model(opacity=0.25).opacity == 0.25 and "opacity=0.25" in repr(model(opacity=0.25))
    with pytest.raises(ValueError, match="^opacity: expected a number from 0 to 1, got "):
        model(opacity=opacity)
