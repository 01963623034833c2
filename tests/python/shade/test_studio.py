"""Studio light: its parts, the ground and its shadows."""

import numpy as np
import pytest
import scipy.ndimage
from spheres import mesh_sphere, sphere

import isospline
from isospline._core import tone_mapped
from isospline.colors import named_color

SIZE = (96, 72)
FEW = isospline.Studio(light_samples=2)


def in_all_lights(scene, camera, light, looks, rays):
    """The sum of pictures in each light of a studio, tone mapped, and its alpha."""
    right, up, forward = camera.world_to_camera[:3, :3]
    towards = 1.1 * right - 1.2 * up + 0.8 * forward
    key = isospline.DirectionalLight(towards, intensity=light.key, angle=14)
    fill = isospline.DirectionalLight(-right + 0.1 * up + 0.8 * forward, intensity=light.fill)
    extents = scene.extent(np.eye(3))
    radius = np.linalg.norm(extents[:, 1] - extents[:, 0]) / 2

    def part(shading_of):
        shadings = {id: shading_of(look) for id, look in looks.items()}
        return isospline.render(scene, camera, size=SIZE, light=shadings, samples=2).color

    in_key = part(lambda look: look.replace(ambient=0, lights=[key], shadows=True, shadow_samples=rays))
    in_fill = part(lambda look: look.replace(ambient=0, specular=0, lights=[fill]))
    in_sky = part(
        lambda look: isospline.AmbientOcclusion(rays, distance=radius, color=look.color, opacity=look.opacity)
    )
    alpha = in_key[..., 3:]
    total = in_key[..., :3] + in_fill[..., :3] + light.sky * in_sky[..., :3]
    straight = (total / np.maximum(alpha, 1e-6)).reshape(-1, 3)
    return tone_mapped(straight, "neutral").reshape(total.shape) * alpha, alpha


def test_studio_light_is_key_fill_and_sky():
    """The means over blocks of pixels change the sum of the lights at shadows only."""
    scene = isospline.Scene([sphere(), mesh_sphere(5.0, 32)])
    camera = isospline.camera_for(scene, size=SIZE)
    look = isospline.Phong(color=(0.9, 0.5, 0.2), specular=0.3)
    material = isospline.Material((0.9, 0.5, 0.2), specular=0.75)
    light = isospline.Studio(key=1.1, fill=0.4, sky=0.5, ground=False, light_samples=64, material=material)
    image = isospline.render(scene, camera, size=SIZE, light=light, samples=2, background="transparent")
    expected, alpha = in_all_lights(scene, camera, light, dict.fromkeys(scene.ids, look), 64)
    error = np.abs(image.color[..., :3] - expected)
    assert error.mean() < 2e-3 and np.quantile(error, 0.99) < 0.03 and error.max() < 0.2
    np.testing.assert_array_equal(image.color[..., 3:], alpha)


def test_surfaces_seen_through_others_keep_their_hues():
    """A red ball in the shadow of a blue one around it."""
    scene = isospline.Scene([sphere(4.0), sphere()])
    camera = isospline.camera_for(scene, size=SIZE)
    looks = {0: isospline.Phong(color=(1, 0, 0), specular=0), 1: isospline.Phong(color=(0, 0, 1), opacity=0.7)}
    materials = {0: isospline.Material((1, 0, 0), specular=0), 1: isospline.Material((0, 0, 1), opacity=0.7)}
    light = isospline.Studio(ground=False, materials=materials)
    image = isospline.render(scene, camera, size=SIZE, light=light, background="transparent")
    expected, alpha = in_all_lights(scene, camera, light, looks, 256)
    red = (expected[..., 0] > 0.08) & (alpha[..., 0] == 1)
    assert red.sum() > 200
    error = (image.color[..., :3] - expected)[red]
    assert np.abs(error.mean(axis=0)).max() < 0.005 and error.std(axis=0).max() < 0.03


def test_few_rays_give_the_light_of_many():
    """Shadows and hollows at four rays a pixel, beside 128: the means over blocks leave little noise, and no bias."""
    field = isospline.volumes.gyroid()
    surface = isospline.Isosurface(field.volume(40), field.level, closed=True)
    options = dict(size=(160, 120), background="white", layers=("mask",))
    few, many = (
        isospline.render(surface, light=isospline.Studio(), samples=samples, **options) for samples in (4, 128)
    )
    for shown, noise in ((few.mask, 0.02), (~few.mask, 0.012)):
        error = (few.color - many.color)[shown][:, :3]
        assert np.sqrt((error**2).mean()) < noise and abs(error.mean()) < 0.002


def test_only_pixels_with_several_surfaces_have_several_rays():
    """Those whose colour differs from a neighbour's: outlines, here. Shadows have the same rays."""
    surface, light, size = sphere(), isospline.Studio(ground=False), (400, 300)
    one, four = (isospline.render(surface, size=size, light=light, samples=samples) for samples in (1, 4))
    outline = isospline.render(surface, size=size, light="phong", samples=16).color[..., 3]
    beside = scipy.ndimage.maximum_filter((outline > 0) & (outline < 1), 21)
    np.testing.assert_array_equal(one.color[~beside], four.color[~beside])
    assert (one.color != four.color).any(axis=-1)[beside].mean() > 0.02


@pytest.mark.parametrize("column", [20, 21])
@pytest.mark.parametrize("samples", [1, 4])
def test_surfaces_one_pixel_wide_have_shadows(column, samples):
    """Below an invisible cover, which hides the key light and the sky."""
    x = column - 20 + 0.5 + np.array([-0.45, 0.45, 0.45, -0.45])
    strip = isospline.Mesh(np.column_stack([x, [-12, -12, 12, 12], [0] * 4]), [(0, 1, 2), (0, 2, 3)], color="white")
    wide = 40 * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    cover = isospline.Mesh(np.column_stack([wide, [5] * 4]), [(0, 1, 2), (0, 2, 3)])
    camera = isospline.OrthographicCamera((0, 0, 50), (0, 0, 0), (0, 1, 0), height=30)
    options = dict(
        size=(40, 30), light=isospline.Studio(ground=False, fill=0), samples=samples, background="transparent"
    )
    scene = isospline.Scene([strip])
    lit = isospline.render(scene, camera, **options).color[10:20, column]
    scene.add(cover, visible=False)
    dark = isospline.render(scene, camera, **options).color[10:20, column]
    assert (dark[:, 3] > 0.8).all() and (dark[:, 0] < 0.3 * lit[:, 0]).all()


def test_a_lens_has_all_rays_in_all_pixels():
    """Out of focus, the outline is as wide as with Phong's model, in which each pixel has all rays."""
    camera = isospline.camera_for(sphere(), size=SIZE).with_lens(aperture_radius=2.0, focus_distance=10.0)
    options = dict(size=SIZE, samples=16, background="transparent")
    image = isospline.render(sphere(), camera, light=isospline.Studio(ground=False), **options)
    plain = isospline.render(sphere(), camera, light="phong", **options)
    np.testing.assert_array_equal(image.color[..., 3], plain.color[..., 3])
    assert ((plain.color[..., 3] > 0) & (plain.color[..., 3] < 1)).mean() > 0.1


def test_many_rays_to_lights_are_cut_down_to_what_pictures_can_show():
    options = dict(size=(8, 6), samples=3, background="transparent")
    light = isospline.Studio(ground=False, light_samples=65536)
    image = isospline.render(sphere(), light=light, **options)
    other = isospline.render(sphere(), light=light.replace(light_samples=256), **options)
    np.testing.assert_array_equal(image.color, other.color)


@pytest.mark.parametrize("layers", [("ambient_occlusion",), ()])
def test_pictures_with_layers_can_be_cancelled_from_the_start(layers):
    told = []

    def progress(fraction):
        told.append(fraction)
        return fraction > 0

    options = dict(size=(100, 80), layers=layers, ambient_occlusion_samples=64, light=FEW)
    with pytest.raises(isospline.Cancelled):
        isospline.render(sphere(), progress=progress, **options)
    assert told == [0]


def test_no_highlight_is_blown_out():
    white = isospline.Material("white", specular=1.0)
    for light in (isospline.Studio(key=3, light_samples=1), isospline.Studio(key=3, fast=True)):
        image = isospline.render(sphere(), size=SIZE, light=light.replace(material=white))
        covered = image.color[..., 3] == 1
        assert image.color[covered, :3].max() < 1


def test_the_ground_has_the_background_but_for_shadows():
    background = named_color("#e8ebef")
    with_ground = isospline.render(sphere(), size=SIZE, light=FEW, background="#e8ebef")
    without = isospline.render(
        sphere(), size=SIZE, light=isospline.Studio(light_samples=2, ground=False), background="#e8ebef"
    )
    outside = np.isclose(isospline.render(sphere(), size=SIZE, light="phong", samples=4).color[..., 3], 0)
    np.testing.assert_allclose(without.color[outside, :3], np.broadcast_to(background, (outside.sum(), 3)), atol=1e-6)
    share = with_ground.color[outside, :3] / background
    assert (share <= 1 + 1e-5).all() and share.min() < 0.6  # there is a shadow
    np.testing.assert_allclose(share[:, 0], share[:, 2], atol=1e-5)  # without a colour
    np.testing.assert_allclose(with_ground.color[0, [0, -1], :3], [background] * 2, atol=1e-5)  # and no horizon
    assert (with_ground.color[..., 3] == 1).all()
    # Everything except the ground is the same.
    inside = isospline.render(sphere(), size=SIZE, light="phong", samples=4).color[..., 3] == 1
    both = inside & (without.color[..., 3] == 1)
    np.testing.assert_allclose(with_ground.color[both], without.color[both], atol=0.3)


def test_a_ground_that_the_key_light_does_not_reach_has_the_background():
    """Without a key light, and with a camera on its side, so that the light from over its shoulder comes from below."""
    upright = isospline.camera_for(sphere(), view=(1, -2, 1), size=SIZE, margin=0.5)
    right = upright.world_to_camera[0, :3]
    on_its_side = isospline.PerspectiveCamera(upright.eye, upright.target, -right, upright.field_of_view)
    for camera, light in ((upright, FEW.replace(key=0)), (on_its_side, FEW.replace(up=(0, 0, 1)))):
        share = isospline.render(sphere(), camera, size=SIZE, light=light, background="white").color[..., 0]
        np.testing.assert_allclose(share[[0, 0, -1, -1], [0, -1, 0, -1]], 1, atol=1e-5)
        assert light.key or share[40:].min() < 0.75  # the sky has a shadow
    dark = FEW.replace(key=0, sky=0)
    image = isospline.render(sphere(), upright, size=SIZE, light=dark, background="transparent")
    plain = isospline.render(sphere(), upright, size=SIZE, light=dark.replace(ground=False), background="transparent")
    np.testing.assert_array_equal(image.color[..., 3], plain.color[..., 3])


@pytest.mark.parametrize("view, up", [((1, -2, -1), (0, 0, -1)), ((1, -2, 1), (0, 0, 1)), ("bottom", (0, 0, 1))])
def test_the_ground_is_on_the_lower_side_of_the_picture(view, up):
    camera = isospline.camera_for(sphere(), view=view, up=None if view == "bottom" else up, size=SIZE)
    options = dict(size=SIZE, background="white")
    image = isospline.render(sphere(), camera, light=FEW, **options)
    expected = isospline.render(sphere(), camera, light=FEW.replace(up=up), **options)
    np.testing.assert_array_equal(image.color, expected.color)


def test_shadows_are_kept_where_there_is_no_background():
    image = isospline.render(sphere(), size=SIZE, light=FEW, background="transparent")
    outside = np.isclose(isospline.render(sphere(), size=SIZE, light="phong", samples=4).color[..., 3], 0)
    assert (image.color[outside, :3] == 0).all()
    assert image.color[outside, 3].max() > 0.3 and image.color[0, 0, 3] < 1e-5


@pytest.mark.parametrize("view", ["bottom", (0.5, -1, -0.8)])
@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
def test_a_ground_hides_nothing_from_below(view, projection):
    camera = isospline.camera_for(sphere(), view=view, projection=projection, size=SIZE)
    image = isospline.render(sphere(), camera, size=SIZE, light=FEW, background="transparent", samples=1)
    plain = isospline.render(sphere(), camera, size=SIZE, light="phong")
    np.testing.assert_array_equal(image.color[..., 3], plain.color[..., 3])


def test_the_given_scene_stays_as_it_is():
    scene = isospline.Scene([sphere()])
    scene.add(mesh_sphere(40.0, 16), visible=False, casts_shadow=False)
    before = {id: scene.visibility(id) for id in scene.ids}
    isospline.render(scene, size=SIZE, light=FEW)
    assert {id: scene.visibility(id) for id in scene.ids} == before


def test_layers_and_opacity_come_along():
    scene = isospline.Scene([sphere(), sphere(4.0)])
    looks = {0: isospline.Material("peru", opacity=0.3), 1: isospline.Material("ivory")}
    camera = isospline.camera_for(scene, size=SIZE)
    image = isospline.render(scene, camera, size=SIZE, light=FEW.replace(materials=looks), layers=("depth", "normal"))
    plain = isospline.render(
        scene, camera, size=SIZE, light={0: isospline.Phong(opacity=0.3)}, layers=("depth", "normal")
    )
    np.testing.assert_array_equal(image.depth, plain.depth)
    np.testing.assert_array_equal(image.normal, plain.normal)


def test_progress_goes_up_to_one():
    for light in (FEW, isospline.Studio(fast=True)):
        told = []
        isospline.render(sphere(), size=(400, 300), light=light, progress=told.append)
        assert told == sorted(told) and told[-1] == 1
    with pytest.raises(isospline.Cancelled):
        isospline.render(sphere(), size=(400, 300), light=FEW, progress=lambda fraction: fraction < 0.5)


def test_an_empty_scene_and_a_panorama():
    image = isospline.render(
        isospline.Scene(),
        isospline.PerspectiveCamera((0, 0, 0), (1, 0, 0)),
        size=SIZE,
        light=FEW,
        background="white",
    )
    np.testing.assert_allclose(image.color, 1)
    isospline.render(sphere(), isospline.PanoramicCamera((11.5, 11.5, 11.5), (0, 1, 0)), size=SIZE, light=FEW)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (dict(light=3), "^light: expected a Studio, a Phong, .* got 3"),
        (dict(light=FEW.replace(materials={5: isospline.Material()})), "^materials: expected geometry ids"),
        (dict(light=FEW, encoding="srgb"), '^encoding: expected "linear" or "srgb8", got "srgb"'),
        (dict(light=FEW, background=(1, 2)), "^background: expected None, a name"),
        (dict(light=FEW, background=255), "^background: expected numbers from 0 to 1"),
    ],
)
def test_what_does_not_go_with_it(options, message):
    with pytest.raises((ValueError, TypeError), match=message):
        isospline.render(sphere(), size=(16, 9), **options)


@pytest.mark.parametrize("options", [dict(key=-1), dict(sky=float("nan")), dict(up=(0, 0, 0)), dict(light_samples=0)])
def test_bad_studios(options):
    with pytest.raises(ValueError, match=f"^{next(iter(options))}: expected "):
        isospline.Studio(**options)


def test_surfaces_too_translucent_to_be_stored_are_not_seen():
    """Their opacity rounds to 0 in single precision where they face the viewer."""
    veil = isospline.Material(opacity=0, silhouette_opacity=1, silhouette_exponent=60)
    light = FEW.replace(material=veil, ground=False)
    image = isospline.render(sphere(), size=SIZE, light=light, background="transparent")
    assert np.isfinite(image.color).all()
    row = image.color[SIZE[1] // 2, :, 3]
    assert row.max() > 1e-4 and (row[SIZE[0] // 2 - 5 : SIZE[0] // 2 + 5] == 0).all()


def test_places_far_from_the_origin_look_the_same():
    """Thin plates one above the other, at the origin and in coordinates of a map."""
    z, y, x = np.mgrid[0:32, 0:32, 0:32] * 4 / 31 - 2
    plates = np.maximum.reduce([np.minimum(0.12 - np.abs(z - c), 1.2 - np.hypot(x, y)) for c in (-0.8, -0.2, 0.4)])
    pictures = []
    for place in (np.zeros(3), np.array([2.0**19, 2.0**22, 256])):
        volume = isospline.Volume(plates, spacing=4 / 31, origin=place - 2)
        camera = isospline.PerspectiveCamera(place + (3, -5, 3.5), place)
        surface = isospline.Isosurface(volume, 0.0)
        pictures.append(
            isospline.render(surface, camera, size=(80, 60), light=isospline.Studio()).to_srgb().astype(int)
        )
    assert np.abs(pictures[1] - pictures[0]).max() <= 1


@pytest.mark.parametrize("light", [FEW, isospline.AmbientOcclusion(4)], ids=["studio", "sky"])
def test_hits_without_a_normal_are_shaded(light):
    # At a level that is the value of a whole region, the gradient of some hits is zero.
    data = np.zeros((20, 20, 20))
    data[8:12, 8:12, 8:12] = 1
    scene = isospline.Scene([isospline.Isosurface(isospline.Volume(data), 0)])
    camera = isospline.camera_for(scene)
    hits = scene.cast_rays(camera.rays((200, 200)))
    assert (np.isfinite(hits["t_hit"]) & ~hits["primitive_normals"].any(axis=-1)).any()
    assert np.isfinite(isospline.render(scene, camera, size=(200, 200), light=light).color).all()
