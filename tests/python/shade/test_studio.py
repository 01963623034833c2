"""Studio light: its parts, the ground and its shadows."""

import numpy as np
import pytest
import scipy.ndimage
from spheres import mesh_sphere, sphere

import isospline
from isospline import _core
from isospline._core import mean_on_plane
from isospline.colors import named_color
from isospline.picture.tone import tone_mapped

SIZE = (96, 72)
FEW = isospline.Studio(light_samples=2)


def test_studio_light_is_key_fill_and_sky():
    """The sum of pictures in each light, tone mapped. The means over blocks of pixels change it at shadows only."""
    scene = isospline.Scene([sphere(), mesh_sphere(5.0, 32)])
    camera = isospline.camera_for(scene, size=SIZE)
    look = isospline.Phong(color=(0.9, 0.5, 0.2), specular=0.3)
    material = isospline.Material((0.9, 0.5, 0.2), specular=0.75)
    light = isospline.Studio(key=1.1, fill=0.4, sky=0.5, ground=False, light_samples=64, material=material)
    image = isospline.render(scene, camera, size=SIZE, light=light, samples=2, background="transparent")

    right, up, forward = camera.world_to_camera[:3, :3]
    towards = 1.1 * right - 1.2 * up + 0.8 * forward
    key = isospline.DirectionalLight(towards, intensity=1.1, angle=14)
    fill = isospline.DirectionalLight(-right + 0.1 * up + 0.8 * forward, intensity=0.4)
    extents = scene.extent(np.eye(3))
    radius = np.linalg.norm(extents[:, 1] - extents[:, 0]) / 2

    def part(shading):
        return isospline.render(scene, camera, size=SIZE, light=shading, samples=2).color

    in_key = part(look.replace(ambient=0, lights=[key], shadows=True, shadow_samples=64))
    in_fill = part(look.replace(ambient=0, specular=0, lights=[fill]))
    in_sky = part(isospline.AmbientOcclusion(64, distance=radius, color=look.color))
    alpha = in_key[..., 3:]
    total = in_key[..., :3] + in_fill[..., :3] + 0.5 * in_sky[..., :3]
    straight = (total / np.maximum(alpha, 1e-6)).reshape(-1, 3)
    expected = tone_mapped(straight, "neutral").reshape(total.shape) * alpha
    error = np.abs(image.color[..., :3] - expected)
    assert error.mean() < 2e-3 and np.quantile(error, 0.99) < 0.03 and error.max() < 0.2
    np.testing.assert_array_equal(image.color[..., 3:], alpha)


def test_few_rays_give_the_light_of_many():
    """Shadows and hollows at four rays a pixel, beside 256: the means over blocks leave little noise, and no bias."""
    field = isospline.volumes.gyroid()
    surface = isospline.Isosurface(field.volume(40), field.level, closed=True)
    options = dict(size=(160, 120), background="white", layers=("mask",))
    few, many = (
        isospline.render(surface, light=isospline.Studio(), samples=samples, **options) for samples in (4, 256)
    )
    for shown, noise in ((few.mask, 0.05), (~few.mask, 0.012)):
        error = (few.color - many.color)[shown][:, :3]
        assert np.sqrt((error**2).mean()) < noise and abs(error.mean()) < 0.002


def test_the_mean_over_a_block_leaves_constants_and_takes_patterns_away():
    pattern = np.random.default_rng(3).random((4, 4))
    tiled = np.tile(pattern, (6, 8)).astype(np.float32)
    smooth = mean_on_plane(tiled, np.ones_like(tiled), (0, 0), 1)
    np.testing.assert_allclose(smooth[2:-2, 2:-2], pattern.mean(), rtol=1e-5)
    known = np.random.default_rng(4).random(tiled.shape) < 0.5
    box = np.outer(*2 * [(0.5, 1, 1, 1, 0.5)])
    sums = [scipy.ndimage.correlate(each, box, mode="constant") for each in (tiled * known, known.astype(float))]
    np.testing.assert_allclose(mean_on_plane(tiled, known, (0, 0), 1), sums[0] / sums[1], rtol=1e-5)


@pytest.mark.parametrize("first", [(0, 0), (3, 4)])
def test_a_coarse_mean_is_that_of_every_second_pixel_of_the_whole_picture(first):
    random = np.random.default_rng(5)
    numbers, weights = random.random((2, 21, 26)).astype(np.float32)
    rows, columns = np.indices(numbers.shape)
    weights[(rows + first[1]) % 2 + (columns + first[0]) % 2 > 0] = 0
    box = np.outer(*2 * [(0.5, 1, 1, 1, 1, 1, 1, 1, 0.5)])
    sums = [scipy.ndimage.correlate(each, box, mode="constant") for each in (numbers * weights, weights)]
    np.testing.assert_allclose(mean_on_plane(numbers, weights, first, 2), sums[0] / sums[1], rtol=1e-5)
    untouched = weights + np.where(weights == 0, 1, 0).astype(np.float32)
    np.testing.assert_array_equal(
        mean_on_plane(numbers, untouched, first, 2), mean_on_plane(numbers, weights, first, 2)
    )


@pytest.mark.parametrize("reach", [0, 1, 4])
def test_masks_are_widened_by_columns_and_rows(reach):
    mask = np.random.default_rng(6).random((30, 41)) < 0.02
    expected = scipy.ndimage.maximum_filter(mask, 2 * reach + 1, mode="constant")
    np.testing.assert_array_equal(_core.widened(mask, reach), expected)


def test_only_pixels_with_several_surfaces_have_several_rays():
    """Those whose colour differs from a neighbour's: outlines, here. Shadows have the same rays."""
    surface, light, size = sphere(), isospline.Studio(ground=False), (400, 300)
    one, four = (isospline.render(surface, size=size, light=light, samples=samples) for samples in (1, 4))
    outline = isospline.render(surface, size=size, light="phong", samples=16).color[..., 3]
    beside = scipy.ndimage.maximum_filter((outline > 0) & (outline < 1), 21)
    np.testing.assert_array_equal(one.color[~beside], four.color[~beside])
    assert (one.color != four.color).any(axis=-1)[beside].mean() > 0.02


def test_pixels_are_rendered_again_as_in_the_whole_picture():
    scene, other = isospline.Scene([sphere()]), isospline.Scene([sphere(4.0)])
    camera = isospline.camera_for(scene, size=SIZE)
    options = dict(size=SIZE, shadings=[isospline.Phong(), isospline.Phong(color="peru")], crop=(7, 5, 60, 50))
    arrays = dict(layers=("depth",), ambient_occlusion_samples=1, progress=None, samples=3, **options)
    pictures, expected = (_core.render_looks(each, camera, **arrays) for each in (other, scene))
    before = [picture.copy() for picture in pictures]
    mask = np.random.default_rng(7).random((50, 60)) < 0.7
    _core.render_again(scene, camera, images=pictures, mask=mask, step=3, samples=3, progress=None, **options)
    rows, columns = np.indices(mask.shape)
    again = mask & ((rows + 5) % 3 == 0) & ((columns + 7) % 3 == 0)
    for picture, old, new in zip(pictures, before, expected):
        np.testing.assert_array_equal(picture.color, np.where(again[..., None], new.color, old.color))
        assert picture.covered_count == (picture.color[..., 3] > 0).sum()
    np.testing.assert_array_equal(pictures[0].depth, before[0].depth)
    with pytest.raises(ValueError, match="^images: expected one of the window's size for each look"):
        _core.render_again(scene, camera, images=pictures[:1], mask=mask, step=3, samples=3, progress=None, **options)
    with pytest.raises(ValueError, match="^mask: expected a number for each pixel"):
        _core.render_again(scene, camera, images=pictures, mask=mask[1:], step=1, samples=3, progress=None, **options)


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
