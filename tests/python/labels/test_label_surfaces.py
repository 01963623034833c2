"""Surfaces of labels: their volume, the side of voxel centres, smoothness, and where labels meet."""

import numpy as np
import pytest
from labels import label_maps as maps
from scipy import ndimage

import isospline

BODIES = {
    "small sphere": lambda: maps.sphere(5)[0],
    "sphere": lambda: maps.sphere(20)[0],
    "torus": lambda: maps.torus()[0],
    "plate and ball": maps.plate_and_ball,
    "oblique wall": maps.oblique_wall,
    "blobs": lambda: maps.blobs(1, 2.5),
    "fine blobs": lambda: maps.blobs(2, 1.2),
    "crumbs": maps.crumbs,
}


def volume_error(surface, mask):
    """Of the enclosed volume, relative to that of the voxels."""
    return surface.enclosed_volume().value / (np.count_nonzero(mask) * np.prod(surface.volume.spacing)) - 1


def centers(shape):
    return np.stack(np.meshgrid(*map(np.arange, shape[::-1]), indexing="ij"), axis=-1).reshape(-1, 3)


@pytest.mark.sweep(4)
@pytest.mark.slow
@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("smoothing", [1.0, 1.5])
def test_volume_is_that_of_the_voxels_and_centres_keep_their_side(body, smoothing):
    data = BODIES[body]()
    surface = isospline.Labels(data).surface(1, smoothing=smoothing)
    assert abs(volume_error(surface, data)) < 0.005
    places = centers(data.shape)
    np.testing.assert_array_equal(surface.contains(places), data[tuple(places.T[::-1])] == 1)


@pytest.mark.sweep(1)
@pytest.mark.slow
@pytest.mark.parametrize("smoothing", [0.5, 2.5, 4.0])
def test_any_smoothing_keeps_volume(smoothing):
    for data in (maps.sphere(12)[0], maps.plate_and_ball()):
        assert abs(volume_error(isospline.Labels(data).surface(1, smoothing=smoothing), data)) < 0.005


@pytest.mark.slow
@pytest.mark.parametrize(("spacing", "bound"), [((1, 1, 1), 1.7), ((0.7, 0.7, 2.5), 5.0), ((2, 1, 0.5), 4.0)])
def test_normals_are_those_of_the_voxelised_sphere(spacing, bound):
    data, normals = maps.sphere(20, spacing=spacing)
    surface = isospline.Labels(data, spacing=spacing).surface(1)
    assert abs(volume_error(surface, data)) < 0.005
    found = surface.sample_points(5000)
    cosines = (found.primitive_normals * normals(found.points)).sum(axis=1)
    assert np.degrees(np.arccos(np.clip(cosines, -1, 1))).mean() < bound  # stairs: 24 degrees


def test_normals_are_those_of_the_voxelised_torus():
    data, normals = maps.torus()
    found = isospline.Labels(data).surface(1).sample_points(5000)
    cosines = (found.primitive_normals * normals(found.points)).sum(axis=1)
    assert np.degrees(np.arccos(np.clip(cosines, -1, 1))).mean() < 2.3


def test_two_labels_share_one_surface():
    ball = maps.sphere(16)[0]
    data = np.where(ball, 1, 2).astype(np.uint8)  # no voxel is background
    labels = isospline.Labels(data)
    inner, outer = labels.surface(1), labels.surface(2)
    points = inner.sample_points(2000).points
    assert outer.closest_points(points).distances.max() < 1e-4  # voxels
    assert abs(volume_error(inner, ball)) < 0.005


@pytest.mark.slow
def test_neighbours_meet_without_gaps_and_overlaps():
    data = maps.cells()
    labels = isospline.Labels(data)
    surfaces = {number: labels.surface(number) for number in range(1, 8)}
    for number, surface in surfaces.items():
        assert abs(volume_error(surface, data == number)) < 0.005
    # Gaps and overlaps are near the lines where three labels meet.
    points = np.random.default_rng(0).uniform(0, 63, (50000, 3))
    count = sum(surface.contains(points).astype(int) for surface in surfaces.values())
    in_ball = np.linalg.norm(points - maps.CENTER, axis=1) < 24
    assert (count[in_ball] == 0).mean() < 0.002
    assert (count[in_ball] > 1).mean() < 0.002
    # At some distance from them, surfaces are the same.
    for first, second in ((3, 7), (4, 5), (5, 6)):
        found = surfaces[first].sample_points(2000).points
        voxels = tuple(np.round(found).astype(int).T[::-1])
        third = ndimage.distance_transform_edt((data == first) | (data == second))[voxels]
        beside = ndimage.distance_transform_edt(data != second)[voxels] < 2
        apart = surfaces[second].closest_points(found).distances
        assert (beside & (third > 3)).sum() > 100
        assert apart[beside & (third > 3)].max() < 0.02
        assert apart[beside & (third > 8)].max() < 0.002
    # Voxels whose neighbours all have the same label are in its surface.
    for number, surface in surfaces.items():
        deep = np.argwhere(ndimage.binary_erosion(data == number, np.ones((3, 3, 3))))[:, ::-1]
        moved = deep + np.random.default_rng(number).uniform(-0.5, 0.5, deep.shape)
        assert surface.contains(moved).mean() > 0.999


def test_a_label_at_the_border_is_closed_there():
    data = np.zeros((30, 31, 32), np.uint8)
    data[:12, :, 5:20] = 3
    surface = isospline.Labels(data, spacing=(1, 1, 2)).surface(3)
    assert surface.closed
    assert abs(volume_error(surface, data == 3)) < 0.005


@pytest.mark.parametrize("shape", [(1, 8, 8), (8, 1, 8), (8, 8, 1)])
def test_thin_maps_keep_volume(shape):
    labels = isospline.Labels(np.random.default_rng(0).integers(0, 3, shape))
    found = labels.measure()
    np.testing.assert_allclose(found.enclosed_volumes, found.voxel_counts, rtol=0.005)


def one_voxel(*shape):
    data = np.zeros(shape, int)
    data[tuple(count // 2 for count in shape)] = 1
    return data


@pytest.mark.parametrize(
    ("data", "spacing", "smoothing"),
    [
        (one_voxel(11, 5, 9), (0.5, 0.5, 5.18), 0.8),
        (one_voxel(13, 9, 3), (0.5, 0.5, 5.78), 0.8),
        ((np.random.default_rng(0).random((30, 30, 30)) < 0.05).astype(int), (1, 1, 1), 0.5),
    ],
)
def test_specks_keep_volume(data, spacing, smoothing):
    surface = isospline.Labels(data, spacing=spacing).surface(1, smoothing=smoothing)
    assert abs(volume_error(surface, data)) < 0.005


@pytest.mark.parametrize("smoothing", [0.4, 5, float("nan")])
def test_wrong_smoothing(smoothing):
    with pytest.raises(ValueError, match="smoothing: expected a number of voxels from 0.5 to 4"):
        isospline.Labels(maps.crumbs()).surface(1, smoothing=smoothing)


def test_labels_of_any_number_are_apart():
    data = np.zeros((12, 12, 12), np.uint64)
    data[1:6, 1:6, 1:6], data[6:11, 1:6, 1:6], data[1:6, 6:11, 1:6] = 1, 2**32 + 1, 2**33
    small = isospline.Labels(np.unique(data, return_inverse=True)[1].reshape(data.shape))
    wide = isospline.Labels(data)
    for number, rank in ((1, 1), (2**32 + 1, 2), (2**33, 3)):
        assert wide.surface(number).enclosed_volume() == small.surface(rank).enclosed_volume()
    inverse = isospline.Labels(np.where(data == 0, 2**32 - 1, 7).astype(np.uint32), background=2**32 - 1)
    assert inverse.measure().voxel_counts == [3 * 125]
