"""Translucent surfaces against closed forms, and against the over operator on all crossings in NumPy."""

import numpy as np
import pytest
from layered import render

import isospline
from isospline.colors import linear

OUTER, INNER = 6.3, 3.7
SIZE = (120, 90)
CAMERA = isospline.PerspectiveCamera((4, -25, 9), (0, 0, 0), field_of_view=40)
LIGHTS = [isospline.PositionalLight((10, -20, 15), intensity=(1, 0.9, 0.8)), isospline.DirectionalLight((1, 0.5, -2))]
FLOOR = isospline.Mesh([[-40, -40, -8], [40, -40, -8], [40, 40, -8], [-40, 40, -8]], [[0, 1, 2], [0, 2, 3]])
#: The colours at the corners of a triangle through both balls.
BLADE_COLORS = np.array([(1, 0, 0), (0, 1, 0), (0.2, 0.3, 1)])
BLADE = isospline.Mesh([[-9, -1, -7], [9, 1, -6], [1, 2, 12]], [[0, 1, 2]], colors=linear(BLADE_COLORS))


def ball(radius, center=(0, 0, 0)):
    """f = |x - center|^2; a quadratic model holds it exactly outside the reach of the boundary rule."""
    z, y, x = np.mgrid[-16:17, -16:17, -16:17].astype(float)
    volume = isospline.Volume(x**2 + y**2 + z**2, origin=np.array(center) - 16.0)
    return isospline.Isosurface(volume, radius**2, inside="below")


def dot(a, b):
    return (a * b).sum(-1, keepdims=True)


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def over(layers, opaque_from):
    """Colours (..., 3) and alpha of layers (colour, opacity, whether it exists), from front to back."""
    color, transmittance = np.zeros((*opaque_from, 3)), np.ones(opaque_from)
    for layer, opacity, there in layers:
        opacity = np.where(there, opacity, 0.0)
        color += (transmittance * opacity)[..., None] * np.where(there[..., None], layer, 0.0)
        transmittance *= 1 - opacity
    return color, 1 - transmittance


def roots(rays, radius):
    """t of both crossings with a ball about the origin, NaN if there are none; and the discriminant."""
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
        0: isospline.Outline(2, color=linear((0.2, 0.5, 1)), surface_color=linear((0.1, 0, 0.05)), opacity=shell),
        1: isospline.Outline(1, color=0, surface_color=linear(core)),
    }
    background = np.array((0.4, 0.3, 0.2))
    image = render(scene, CAMERA, size=SIZE, light=shading, background=linear(background))

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

    alone = render(scene, CAMERA, size=SIZE, light=shading)
    np.testing.assert_allclose(alone.color[clear, 3], alpha[clear], atol=1e-6)


MODELS = [
    dict(color=linear((0.9, 0.6, 0.3)), ambient=0.15, diffuse=0.55, specular=0.35, specular_exponent=12, opacity=0.35),
    dict(color=linear((0.2, 0.7, 0.4)), ambient=0.05, diffuse=0.8, specular=0.1, specular_exponent=5, opacity=0.6),
    dict(color=linear((1.0, 0.9, 0.8)), ambient=0.1, diffuse=0.7, specular=0.0, specular_exponent=1, opacity=0.5),
    dict(color=linear((0.8, 0.8, 0.8)), ambient=0.2, diffuse=0.6, specular=0.2, specular_exponent=9, opacity=1.0),
]


def everything(order=(0, 1, 2, 3)):
    """Two balls, the blade in both of them, and an opaque floor, added in some order; and the models by id."""
    objects = [ball(OUTER), ball(INNER, (1, 2, 0.5)), BLADE, FLOOR]
    scene = isospline.Scene([objects[i] for i in order])
    return scene, {geometry: MODELS[i] for geometry, i in enumerate(order)}


def phongs(models, **options):
    return {geometry: isospline.Phong(lights=LIGHTS, **model, **options) for geometry, model in models.items()}


def attenuation(scene, models, position, normal, geometry_ids, primitive_ids, direction, t_far):
    """The transmitted part of a light after the crossings between points and the light, and their number."""
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
    image = render(scene, CAMERA, size=SIZE, light=phongs(models, shadows=shadows))

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
    # The mesh's rounding to single precision moves crossings, which may then be on the other side of a shadow's edge.
    wrong = np.abs(image.color.reshape(-1, 4) - expected).max(-1) > 2e-5
    assert wrong.sum() <= (3 if shadows else 0)


def test_ids_and_threads_do_not_matter():
    pictures = []
    try:
        for order, threads in (((0, 1, 2, 3), 1), ((0, 1, 2, 3), 2), ((3, 1, 0, 2), 2), ((2, 3, 1, 0), 0)):
            isospline.set_thread_count(threads)
            scene, models = everything(order)
            image = render(scene, CAMERA, size=(101, 83), light=phongs(models, shadows=True), samples=2)
            pictures.append((image.color.tobytes(), image.depth.tobytes(), image.normal.tobytes()))
    finally:
        isospline.set_thread_count(0)
    assert all(picture == pictures[0] for picture in pictures)


@pytest.mark.parametrize("shadows", [False, True])
def test_opaque_surfaces_look_the_same(shadows):
    """Translucent objects outside the picture or behind an opaque one do not change a bit of the picture."""
    opaque = isospline.Phong(color=(0.9, 0.6, 0.3), lights=LIGHTS, shadows=shadows)
    objects = [ball(OUTER), FLOOR]
    aside, within = ball(2.0, (300, 0, 0)), ball(2.0)
    pictures = [
        render(isospline.Scene(objects), CAMERA, size=SIZE, light=opaque, samples=2),
        render(
            isospline.Scene([*objects, aside, within]),
            CAMERA,
            size=SIZE,
            light={0: opaque, 1: opaque, 2: isospline.Phong(opacity=0.5), 3: isospline.Outline(opacity=0)},
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
    image = render(scene, CAMERA, size=SIZE, light=shading)
    without = isospline.Scene()
    for geometry, added in ((0, BLADE), (1, ball(INNER, (1, 2, 0.5))), (2, BLADE), (3, FLOOR)):
        assert without.add(added) == geometry
    without.remove(0)
    without.remove(2)
    shading = phongs({1: MODELS[1], 3: MODELS[3]}, shadows=shadows)
    expected = render(without, CAMERA, size=SIZE, light=shading)
    np.testing.assert_array_equal(image.geometry_ids, expected.geometry_ids)
    np.testing.assert_allclose(image.color, expected.color, atol=2e-6)
    np.testing.assert_allclose(image.depth, expected.depth, rtol=1e-6)
    np.testing.assert_allclose(image.normal, expected.normal, atol=1e-6)


def test_all_but_colour_is_of_the_first_surface():
    scene, models = everything()
    translucent = render(scene, CAMERA, size=SIZE, light=phongs(models), layers=("curvature",))
    opaque = {geometry: dict(model, opacity=1.0) for geometry, model in models.items()}
    expected = render(scene, CAMERA, size=SIZE, light=phongs(opaque), layers=("curvature",))
    np.testing.assert_array_equal(translucent.geometry_ids, expected.geometry_ids)
    assert len(np.unique(expected.geometry_ids)) >= 4
    for name in ("depth", "position", "normal", "albedo", "gradient_magnitude", "curvature"):
        np.testing.assert_allclose(getattr(translucent, name), getattr(expected, name), rtol=1e-5, atol=1e-6)


def test_light_on_a_floor_below_a_translucent_ball():
    """A beam through the ball crosses it twice; visibility decides whether the ball casts a shadow."""
    opacity = 0.4
    flat = dict(ambient=0, diffuse=1, specular=0, lights=[isospline.DirectionalLight((0, 0, -1))], shadows=True)
    shading = {0: isospline.Phong(**flat), 1: isospline.Phong(**flat, opacity=opacity)}
    scene = isospline.Scene([FLOOR, ball(OUTER)])
    camera = isospline.PerspectiveCamera((20, 0, -3), (0, 0, -8), field_of_view=40)
    for seen, reaching in ((True, (1 - opacity) ** 2), (False, 1.0)):
        scene.set_visibility(1, casts_shadow=seen)
        image = render(scene, camera, size=SIZE, light=shading)
        radius = np.linalg.norm(image.position[..., :2], axis=-1)
        on_floor = (image.geometry_ids == 0) & (np.abs(radius - OUTER) > 1e-3)
        expected = np.where(radius < OUTER, reaching, 1.0)[on_floor]
        assert 100 < (expected < 1).sum() < 4000 or not seen
        np.testing.assert_allclose(image.color[on_floor, 0], expected, rtol=1e-6)


@pytest.mark.slow
def test_openness_below_a_translucent_ball():
    """The closed form of an opaque ball, times the absorption of two crossings."""
    opacity = 0.4
    center = np.array([1.0, 2.0, 1.0])
    scene = isospline.Scene([FLOOR, ball(OUTER, center)])
    shading = {0: isospline.AmbientOcclusion(1024), 1: isospline.AmbientOcclusion(1, opacity=opacity)}
    camera = isospline.PerspectiveCamera((4, -45, 60), (2, 0, -8), field_of_view=40)
    image = render(scene, camera, size=(60, 45), light=shading)
    offset = center - image.position
    distance = np.linalg.norm(offset, axis=-1)
    covered = offset[..., 2] / distance * (OUTER / distance) ** 2
    on_floor = image.geometry_ids == 0
    assert covered[on_floor].max() > 0.2
    expected = 1 - covered[on_floor] * (1 - (1 - opacity) ** 2)
    np.testing.assert_allclose(image.color[on_floor, 0], expected, atol=8e-3)


def at_silhouettes(cosine, opacity, silhouette_opacity, exponent=3.0):
    """Opacity where <N, V> is the cosine."""
    return opacity + (silhouette_opacity - opacity) * (1 - np.abs(cosine)) ** exponent


@pytest.mark.parametrize("kind", [isospline.Phong, isospline.Outline, isospline.AmbientOcclusion])
def test_opacity_at_silhouettes_is_the_closed_form(kind):
    """A ray enters and leaves a ball at the same angle; an opaque object inside ends it."""
    scene = isospline.Scene([ball(OUTER), ball(INNER)])
    shading = {0: kind(opacity=0.2, silhouette_opacity=0.9, silhouette_exponent=2.5), 1: isospline.Outline()}
    image = render(scene, CAMERA, size=SIZE, light=shading)
    rays = CAMERA.rays(SIZE)
    front, _, outer = roots(rays, OUTER)
    inner = roots(rays, INNER)[2]
    direction = unit(rays[..., 3:])
    cosine = dot((rays[..., :3] + front[..., None] * direction) / OUTER, direction)[..., 0]
    alpha = 1 - (1 - at_silhouettes(cosine, 0.2, 0.9, 2.5)) ** 2
    clear = (outer > 0.5) & (inner < -0.5)
    assert clear.sum() > 800 and alpha[clear].max() > 0.9 and alpha[clear].min() < 0.5
    # As for the colours above: coefficients in single precision move normals.
    np.testing.assert_allclose(image.color[clear, 3], alpha[clear], atol=2e-5)
    np.testing.assert_allclose(image.color[inner > 0.5, 3], 1, atol=1e-6)


def test_silhouettes_are_seen_on_any_background():
    """The edge of a thin skin has its own colour, while its middle shows the objects behind."""
    camera = isospline.OrthographicCamera((0, -20, 0), (0, 0, 0), height=14)
    shading = isospline.Phong(color=(0.9, 0.6, 0.5), opacity=0.1, silhouette_opacity=1, silhouette_exponent=1)
    images = [
        render(isospline.Scene([ball(OUTER)]), camera, size=(141, 141), light=shading, background=background)
        for background in (0, 0.5, 1)
    ]
    radius = np.linalg.norm(camera.rays((141, 141))[..., [0, 2]], axis=-1) / OUTER
    edge, middle = (radius > 0.993) & (radius < 1), radius < 0.1
    assert edge.sum() > 100 and middle.sum() > 50
    differs = np.abs(images[0].color - images[2].color)[..., :3]
    assert differs[edge].max() < 0.03 and differs[middle].min() > 0.75


def test_light_through_a_ball_that_is_opaque_at_its_silhouette():
    """Beams meet the ball at different angles: the rim of the shadow is darker than its middle."""
    flat = dict(ambient=0, diffuse=1, specular=0, lights=[isospline.DirectionalLight((0, 0, -1))], shadows=True)
    shading = {0: isospline.Phong(**flat), 1: isospline.Phong(**flat, opacity=0.2, silhouette_opacity=1)}
    scene = isospline.Scene([FLOOR, ball(OUTER)])
    camera = isospline.PerspectiveCamera((20, 0, -3), (0, 0, -8), field_of_view=40)
    image = render(scene, camera, size=SIZE, light=shading)
    radius = np.linalg.norm(image.position[..., :2], axis=-1)
    on_floor = (image.geometry_ids == 0) & (np.abs(radius - OUTER) > 1e-2)
    cosine = np.sqrt(np.maximum(1 - (radius / OUTER) ** 2, 0))
    expected = np.where(radius < OUTER, (1 - at_silhouettes(cosine, 0.2, 1.0)) ** 2, 1.0)[on_floor]
    assert (expected < 0.2).sum() > 20 and (expected < 1).sum() > 100
    np.testing.assert_allclose(image.color[on_floor, 0], expected, atol=1e-5)


def test_silhouettes_of_meshes_follow_their_normals():
    """A flat square whose normals at its corners lean outwards: its opacity follows them, and not its plane."""
    corners = np.array([(-1, 0, -1), (1, 0, -1), (1, 0, 1), (-1, 0, 1)], float)
    mesh = isospline.Mesh(corners, [(0, 1, 2), (0, 2, 3)], normals=unit(corners + (0, -1, 0)))
    camera = isospline.OrthographicCamera((0, -5, 0), (0, 0, 0), height=2.2)
    shading = isospline.Phong(opacity=0.1, silhouette_opacity=0.8, silhouette_exponent=2)
    image = render(isospline.Scene([mesh]), camera, size=(40, 40), light=shading)
    covered = image.color[..., 3] > 0
    assert covered.sum() > 1000
    expected = at_silhouettes(image.normal[covered][:, 1], 0.1, 0.8, 2)
    assert np.ptp(expected) > 0.05
    np.testing.assert_allclose(image.color[covered, 3], expected, atol=1e-6)


def test_a_silhouette_of_the_same_opacity_changes_nothing():
    scene, models = everything()
    pictures = [
        render(scene, CAMERA, size=SIZE, light=phongs(each, shadows=True), layers=("ambient_occlusion",))
        for each in (models, {id: dict(model, silhouette_opacity=model["opacity"]) for id, model in models.items()})
    ]
    assert pictures[0] == pictures[1]


def test_surfaces_along_a_ray_share_the_samples_of_the_sky_without_bias():
    scene = isospline.Scene([ball(OUTER), ball(INNER), FLOOR])

    def picture(samples, rays):
        light = {id: isospline.AmbientOcclusion(samples, opacity=opacity) for id, opacity in ((0, 0.3), (1, 1), (2, 1))}
        return render(scene, CAMERA, size=(40, 30), light=light, background="black", samples=rays).color[..., :3]

    exact, noisy = picture(400, 4), picture(2, 64)
    assert 0.02 < np.abs(picture(2, 1) - picture(400, 1)).mean() < 0.2
    np.testing.assert_allclose(noisy.mean(), exact.mean(), rtol=0.004)
    assert np.abs(noisy - exact).mean() < 0.03


def test_surfaces_along_a_ray_share_the_points_of_a_large_light_without_bias():
    scene = isospline.Scene([ball(OUTER), ball(INNER), FLOOR])
    sun = isospline.DirectionalLight((1, 0.5, -2), angle=14)

    def picture(samples):
        light = {
            id: isospline.Phong(opacity=part, lights=[sun], shadows=True, shadow_samples=samples)
            for id, part in ((0, 0.3), (1, 1), (2, 1))
        }
        return render(scene, CAMERA, size=(80, 60), light=light, background="black", samples=4).color[..., :3]

    exact, shared = picture(256), picture(4)
    assert 1e-4 < np.abs(shared - exact).mean() < 0.02
    np.testing.assert_allclose(shared.mean(), exact.mean(), rtol=0.003)


@pytest.mark.parametrize("model", [isospline.Phong, isospline.Outline, isospline.AmbientOcclusion])
def test_bad_silhouettes(model):
    thin = model(opacity=0.25, silhouette_opacity=1, silhouette_exponent=2)
    assert "opacity=0.25, silhouette_opacity=1, silhouette_exponent=2" in repr(thin)
    assert model().silhouette_opacity is None and thin.replace(silhouette_opacity=None).silhouette_opacity is None
    with pytest.raises(ValueError, match="^silhouette_opacity: expected a number from 0 to 1"):
        model(silhouette_opacity=1.1)
    with pytest.raises(ValueError, match="^silhouette_exponent: expected a finite number above 0"):
        model(silhouette_exponent=0)


@pytest.mark.parametrize("model", [isospline.Phong, isospline.Outline, isospline.AmbientOcclusion])
@pytest.mark.parametrize("opacity", [-0.1, 1.1, np.nan])
def test_bad_opacity(model, opacity):
    assert model(opacity=0.25).opacity == 0.25 and "opacity=0.25" in repr(model(opacity=0.25))
    with pytest.raises(ValueError, match="^opacity: expected a number from 0 to 1"):
        model(opacity=opacity)
