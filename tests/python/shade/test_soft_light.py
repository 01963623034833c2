"""The parts of soft light: means over blocks of pixels, and pixels that are rendered again."""

import numpy as np
import pytest
import scipy.ndimage
from spheres import sphere

import isospline
from isospline import _core
from isospline._core import mean_on_plane

SIZE = (96, 72)


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
    np.testing.assert_array_equal(pictures[0].depth, before[0].depth)
    same = dict(samples=3, progress=None, **options)
    for bad, message in (
        (dict(images=pictures[:1]), "images: expected one of the window's size for each look"),
        (dict(images=[pictures[0], None]), "images: expected one of the window's size for each look"),
        (dict(mask=mask.T), "mask: expected a bool for each pixel of the window"),
        (dict(step=0), "step: expected a number of at least 1, got 0"),
    ):
        with pytest.raises(ValueError, match=f"^{message}"):
            _core.render_again(scene, camera, **{"images": pictures, "mask": mask, "step": 1, **same, **bad})


def guides_of(scene, camera, size):
    options = dict(layers=("position", "normal", "geometry_ids"), samples=1, ambient_occlusion_samples=1)
    (image,) = _core.render_looks(
        scene, camera, shadings=[isospline.Phong()], size=size, crop=None, progress=None, **options
    )
    return image


def two_squares():
    """Squares at two heights that meet at x = 0 in the picture, and a camera above; a pixel is 1 wide."""
    half = np.array([(-16, -12), (0, -12), (0, 12), (-16, 12)])
    faces = [(0, 1, 2), (0, 2, 3)]
    low = isospline.Mesh(np.column_stack([half, np.full(4, 0.0)]), faces)
    high = isospline.Mesh(np.column_stack([half + (16, 0), np.full(4, 5.0)]), faces)
    camera = isospline.OrthographicCamera((0, 0, 50), (0, 0, 0), (0, 1, 0), height=30)
    return isospline.Scene([low, high]), camera, (40, 30)


def test_edges_are_beside_other_surfaces_and_in_the_background():
    scene, camera, size = two_squares()
    guides = guides_of(scene, camera, size)
    expected = np.ones(size[::-1], dtype=bool)
    expected[3:27, 4:19] = expected[3:27, 21:36] = False
    np.testing.assert_array_equal(_core.edges(guides), expected)


def test_uneven_pixels_differ_from_a_neighbour():
    scene, camera, size = two_squares()
    guides = guides_of(scene, camera, size)
    edges = _core.edges(guides)
    picture = guides.blank()
    color = np.array(picture.color)
    color[..., :3], color[..., 3] = 0.25, 1
    color[10, 10, 1] = 0.25 + 2 * 0.5 * 0.039  # the root differs by less than 0.04
    color[20, 30, 2] = 4.0
    color[20, 29, 2] = 4.0 - 2 * 2 * 0.041  # of bright light, too: shadows may fall on it
    picture.set_color(color)
    around = np.zeros_like(edges)
    around[19:22, 28:32] = True
    seen = np.zeros_like(edges)
    seen[3:27, 4:36] = True
    np.testing.assert_array_equal(_core.uneven_pixels([(picture, 1.0)], guides, edges), around | (edges & seen))


def test_light_changes_fast_over_one_surface_or_where_it_is_not_known():
    scene, camera, size = two_squares()
    guides = guides_of(scene, camera, size)
    edges = _core.edges(guides)
    parts = np.zeros((2, 1, *edges.shape), dtype=np.float32)
    parts[1] = 0.05 * np.arange(size[0])  # 0.2 over four pixels, halfway from slow to fast
    parts[0, 0, 10, 25] = np.nan
    expected = np.zeros(edges.shape)
    rows = np.s_[3:27]
    expected[rows, 4:19] = expected[rows, 21:36] = (0.2 - 0.15) / 0.15
    expected[10, 25] = 1
    np.testing.assert_allclose(_core.changes(parts, guides, edges), expected, atol=1e-5)
    with pytest.raises(ValueError, match=r"^parts: expected shape \(lights, channels, height, width\), got \(30, 40\)"):
        _core.changes(parts[0, 0], guides, edges)
    means = np.zeros(edges.shape, dtype=np.float32)
    means[:, 20:] = 0.04
    expected = np.zeros(edges.shape)
    expected[:, 16:24] = (0.04 - 0.03) / 0.03
    np.testing.assert_allclose(_core.changes_on_plane(means), expected, atol=1e-5)
