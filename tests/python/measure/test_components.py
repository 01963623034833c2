"""Connected components: SciPy's labels, closed forms, meshes split by trimesh, and the results of all queries."""

import copy
import csv
import io
import itertools
import json
import math
import pickle
import threading

import numpy as np
import pytest
import trimesh
from hit_outputs import ALL_OUTPUTS
from scipy import ndimage

import isospline
from isospline.cli.main import main

# Centres (x, y, z) and radii of separate balls.
BALLS = [((12, 13, 12), 9.0), ((38, 12, 13), 6.5), ((36, 36, 30), 5.0), ((12, 38, 34), 2.2)]
# The allowed errors of the volumes and areas of their samples: the smallest ball is hardly resolved.
TOLERANCES = [0.02, 0.03, 0.05, 0.2]


def ball_samples(balls=BALLS, size=48):
    z, y, x = np.mgrid[0:size, 0:size, 0:size].astype(float)
    distance = [r - np.sqrt((x - c[0]) ** 2 + (y - c[1]) ** 2 + (z - c[2]) ** 2) for c, r in balls]
    return np.max(distance, axis=0)


def ball_surface(degree=2, **options):
    return isospline.Isosurface(isospline.Volume(ball_samples(), degree=degree), 0.0, **options)


def noise(shape=(22, 25, 27), seed=1):
    return np.random.default_rng(seed).normal(size=shape)


def solid_labels(samples):
    """SciPy's labels of the samples above zero, with all 26 neighbours, and how many samples each has."""
    labels, count = ndimage.label(samples > 0, structure=np.ones((3, 3, 3)))
    return labels, np.bincount(labels.ravel(), minlength=count + 1)[1:]


def test_a_table_of_comma_separated_values_has_all_numbers(tmp_path):
    found = ball_surface().components()
    text = found.to_csv()
    rows = list(csv.DictReader(io.StringIO(text)))
    corners = [[[float(row[f"bounds_{side}_{axis}"]) for axis in "xyz"] for side in ("lower", "upper")] for row in rows]
    np.testing.assert_array_equal(corners, found.bounds)
    assert [int(row["cell_counts"]) for row in rows] == found.cell_counts.tolist()
    assert len(rows[0]) == 8 and len(text.splitlines()) == 5
    assert found.to_csv(tmp_path / "balls.csv") is None and (tmp_path / "balls.csv").read_text(encoding="utf-8") == text
    with pytest.raises(FileNotFoundError):
        found.to_csv(tmp_path / "missing" / "balls.csv")


def test_a_table_of_hits_has_no_rounding():
    rays = np.float32([[[12.1, 13.2, -9, 0, 0, 1], [0, 0, -9, 0, 0, 1]]])
    hits = isospline.Scene(ball_surface()).cast_rays(rays, outputs=("t_hit", "positions"))
    rows = np.genfromtxt(io.StringIO(hits.to_csv()), delimiter=",", names=True)
    np.testing.assert_array_equal(rows["t_hit"], hits.t_hit[0])
    np.testing.assert_array_equal(rows["positions_z"], hits.positions[0, :, 2])


def test_a_table_of_hits_has_all_outputs():
    rays = np.array([[[12.1, 13.2, -9, 0, 0, 1], [0, 0, -9, 0, 0, 1]]])
    hits = isospline.Scene(ball_surface()).cast_rays(rays, outputs=ALL_OUTPUTS)
    rows = list(csv.DictReader(io.StringIO(hits.to_csv())))
    assert len(rows) == 2 and len(rows[0]) == sum(array[0, 0].size for array in hits.values())
    hit = hits.select((0, 0))
    for name, value in (
        ("t_hit", hit.t_hit),
        ("dnormal_dorigin_x_z", hit.dnormal_dorigin[0, 2]),
        ("dnormal_ddirection_z_x", hit.dnormal_ddirection[2, 0]),
        ("coefficient_weights_20", hit.coefficient_weights[20]),
        ("coefficient_gradients_20_y", hit.coefficient_gradients[20, 1]),
    ):
        assert float(rows[0][name]) == value
    assert int(rows[0]["coefficient_indices_20"]) == hit.coefficient_indices[20]


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_balls_have_their_volume_area_and_box(degree):
    found = ball_surface(degree).components(measured=True)
    assert isinstance(found, isospline.Components)
    radii = np.array([r for _, r in BALLS])
    assert found.enclosed_volumes.shape == (4,)
    assert np.all(abs(found.enclosed_volumes / (4 / 3 * math.pi * radii**3) - 1) < TOLERANCES)
    assert np.all(abs(found.areas / (4 * math.pi * radii**2) - 1) < TOLERANCES)
    for (center, radius), (lower, upper) in zip(BALLS, found.bounds):
        assert np.all(lower <= np.subtract(center, radius) + 0.1) and np.all(lower > np.subtract(center, radius) - 1.1)
        assert np.all(upper >= np.add(center, radius) - 0.1) and np.all(upper < np.add(center, radius) + 1.1)
    assert np.all(found.cell_counts > found.enclosed_volumes)
    assert np.all(np.diff(found.enclosed_volumes) < 0)
    assert np.all(found.inside_counts < found.enclosed_volumes)


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_counts_need_no_integrals(degree):
    surface = ball_surface(degree)
    counted, measured = surface.components(), surface.components(measured=True)
    assert sorted(counted) == ["bounds", "cell_counts", "inside_counts"]
    assert np.all(np.diff(counted.inside_counts) <= 0)
    for name, array in counted.items():
        np.testing.assert_array_equal(array, measured[name])  # balls of different sizes have the same order
    with pytest.raises(AttributeError, match="^areas: expected measured=True for it"):
        counted.areas


@pytest.mark.sweep(2)
@pytest.mark.slow
@pytest.mark.parametrize("degree", [1, 2, pytest.param(3, marks=pytest.mark.long)])
@pytest.mark.parametrize("inside", ["above", "below"])
def test_components_add_up_to_the_solid(degree, inside):
    surface = isospline.Isosurface(
        isospline.Volume(noise((13, 15, 16)), degree=degree, spacing=(1, 2, 0.5)), 1.2, inside=inside
    )
    found = surface.components(measured=True, order=4)
    for total, parts in (
        (surface.enclosed_volume(order=4), found.enclosed_volumes),
        (surface.area(order=4), found.areas),
    ):
        assert parts.sum() == pytest.approx(total.value, rel=1e-12)
    assert found.volume_errors.sum() == pytest.approx(surface.enclosed_volume(order=4).error)
    assert np.all(found.enclosed_volumes[:-1] >= found.enclosed_volumes[1:])


@pytest.mark.parametrize("seed", range(6))
def test_at_degree_1_they_are_those_that_scipy_labels_with_26_neighbours(seed):
    samples = noise(seed=seed) - 1.5
    labels, sizes = solid_labels(samples)
    surface = isospline.Isosurface(isospline.Volume(samples, degree=1), 0.0)
    found = surface.components(measured=True, order=4)
    assert len(found.areas) == len(sizes) > 50
    # Within the volume, the boxes of cells reach one sample farther than the samples of the component.
    expected = []
    for where in ndimage.find_objects(labels):
        lower = [max(each.start - 1, 0) for each in where][::-1]
        upper = [min(each.stop, length - 1) for each, length in zip(where, samples.shape)][::-1]
        expected.append((*lower, *upper))
    assert sorted(map(tuple, found.bounds.reshape(-1, 6).tolist())) == sorted(expected)

    # The samples in the largest component; isospline orders components by volume, and SciPy has no volumes.
    largest = isospline.Isosurface(surface.volume, 0.0, largest=1)
    index = np.argwhere(samples > 0)[:, ::-1]
    kept = np.unique(labels[samples > 0][largest.contains(index)])
    assert len(kept) == 1
    assert np.array_equal(largest.contains(index), labels[samples > 0] == kept[0])
    assert largest.enclosed_volume(order=4).value == pytest.approx(found.enclosed_volumes[0])


@pytest.mark.sweep(2)
@pytest.mark.slow
@pytest.mark.parametrize("degree", [2, 3])
@pytest.mark.parametrize("seed", range(2))
def test_they_are_those_of_the_continuous_model_but_for_pieces_in_one_cell(degree, seed):
    """Compared with labels of f on a grid of 12 points per cell edge; labels that share a cell are joined."""
    samples = noise((9, 10, 11), seed)
    volume = isospline.Volume(samples, degree=degree)
    level, steps = 1.1, 12
    surface = isospline.Isosurface(volume, level)
    shift = 0.5 if degree % 2 == 0 else 0.0
    cells = np.array(samples.shape[::-1]) - (degree % 2)
    axes = [np.arange(n * steps + 1) / steps - shift for n in cells[::-1]]
    z, y, x = np.meshgrid(*axes, indexing="ij")
    solid = volume.sample(np.stack([x, y, z], axis=-1).reshape(-1, 3)).reshape(x.shape) > level
    labels, count = ndimage.label(solid)
    joined = np.arange(count + 1)

    def root(label):
        while joined[label] != label:
            label = joined[label]
        return label

    for k, j, i in np.ndindex(*cells[::-1]):
        block = labels[tuple(slice(steps * at, steps * at + steps + 1) for at in (k, j, i))]
        for a, b in itertools.pairwise(np.unique(block[block > 0]).tolist()):
            joined[max(root(a), root(b))] = min(root(a), root(b))
    expected = {root(label) for label in range(1, count + 1)}
    # The grid misses small pieces, and necks that are thinner than its steps.
    found = surface.components(measured=True, order=4)
    visible = found.enclosed_volumes > 2 / steps**3
    assert visible.sum() <= len(expected) <= len(found.areas) + 1

    # Each component of the grid is in one component of the surface.
    for n in (1, 2, 3):
        kept = isospline.Isosurface(volume, level, largest=n)
        points = np.argwhere(solid)[:, ::-1] / steps - shift
        in_kept = kept.contains(points)
        roots = np.array([root(label) for label in labels[solid]])
        border = np.any(np.isclose(points, -shift) | np.isclose(points, cells - shift), axis=1)
        for each in np.unique(roots):
            assert len(set(in_kept[(roots == each) & ~border])) <= 1
        assert kept.enclosed_volume(order=4).value == pytest.approx(found.enclosed_volumes[:n].sum())


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_meshes_of_the_largest_are_what_trimesh_splits(degree):
    surface = ball_surface(degree)
    parts = sorted(surface.to_mesh().to_trimesh().split(), key=lambda part: -part.volume)
    found = surface.components(measured=True)
    assert len(parts) == len(found.areas)
    assert np.all(abs([part.volume for part in parts] / found.enclosed_volumes - 1) < TOLERANCES)
    for n in range(1, 5):
        mesh = isospline.Isosurface(surface.volume, 0.0, largest=n).to_mesh().to_trimesh()
        assert mesh.is_watertight and len(mesh.split()) == n
        assert mesh.volume == pytest.approx(sum(part.volume for part in parts[:n]), rel=1e-9)


def test_a_cavity_belongs_to_its_solid():
    """A shell of radii 9 and 5, with a ball of radius 3 in its hollow."""
    z, y, x = np.mgrid[0:28, 0:28, 0:28].astype(float) - 13.6
    r = np.sqrt(x**2 + y**2 + z**2)
    volume = isospline.Volume(np.maximum(np.minimum(9 - r, r - 5), 3 - r))
    found = isospline.Isosurface(volume, 0.0).components(measured=True)
    assert len(found.areas) == 2
    np.testing.assert_allclose(found.enclosed_volumes, 4 / 3 * math.pi * np.array([9**3 - 5**3, 3**3]), rtol=0.03)
    np.testing.assert_allclose(found.areas, 4 * math.pi * np.array([9**2 + 5**2, 3**2]), rtol=0.03)
    outer = isospline.Isosurface(volume, 0.0, largest=1)
    center = 13.6
    points = [(center, center, center), (center + 4, center, center), (center + 7, center, center)]
    assert outer.contains(points).tolist() == [False, False, True]
    # Rays through the middle hit the wall twice, and nothing in the hollow.
    crossings = isospline.Scene(outer).list_intersections([(center, center, -10, 0, 0, 1)])
    np.testing.assert_allclose(crossings.t_hit - 10 - center, [-9, -5, 5, 9], atol=0.1)
    # Below the level are the hollow and the surroundings: the hollow is the smaller component.
    below = isospline.Isosurface(volume, 0.0, inside="below").components(measured=True)
    np.testing.assert_allclose(below.enclosed_volumes[1], 4 / 3 * math.pi * (5**3 - 3**3), rtol=0.03)


@pytest.mark.sweep(2)
@pytest.mark.slow
@pytest.mark.parametrize("degree", [1, 2, 3])
@pytest.mark.parametrize("n", [1, 2, 3])
def test_all_queries_see_the_largest_alone(degree, n):
    whole, kept = ball_surface(degree), ball_surface(degree, largest=n)
    assert kept.largest == n and whole.largest is None
    alone = isospline.Isosurface(isospline.Volume(ball_samples(BALLS[:n]), degree=degree), 0.0)
    rng = np.random.default_rng(n)
    points = rng.uniform(0, 47, (600, 3))
    origins = rng.uniform(-20, 68, (2000, 3))
    rays = np.concatenate([origins, rng.uniform(0, 47, (2000, 3)) - origins], axis=1)

    def same(ours, theirs, atol):
        np.testing.assert_allclose(ours, theirs, atol=atol)

    # The ripples of the interpolating spline differ a little between both volumes.
    atol = 1e-6 if degree == 1 else 0.08
    scene, other = isospline.Scene(kept), isospline.Scene(alone)
    for coherent in (False, True):
        hits = scene.cast_rays(rays, coherent=coherent)
        expected = other.cast_rays(rays, coherent=coherent)
        grazing = np.isfinite(hits.t_hit) != np.isfinite(expected.t_hit)
        assert grazing.mean() < 0.002
        seen = np.isfinite(hits.t_hit) & np.isfinite(expected.t_hit)
        apart = (hits.t_hit[seen] - expected.t_hit[seen]) * np.linalg.norm(rays[seen, 3:], axis=1)
        assert np.quantile(abs(apart), 0.98) < 0.1
    assert np.array_equal(scene.test_occlusions(rays), np.isfinite(hits.t_hit))
    assert np.array_equal(scene.count_intersections(rays) > 0, np.isfinite(hits.t_hit))
    assert np.array_equal(isospline.research.VoxelHopper(kept).cast_rays(rays)["t_hit"], hits.t_hit)
    assert not np.any(kept.contains(points) & ~whole.contains(points))
    same(kept.signed_distance(points), alone.signed_distance(points), 0.1)
    same(scene.signed_distance(points), kept.signed_distance(points), 1e-5)
    same(scene.occupancy(points), kept.contains(points), 0)
    parts = whole.components(measured=True, order=4)
    same(kept.area(order=4).value, parts.areas[:n].sum(), 1e-9)
    same(kept.enclosed_volume(order=4).value, parts.enclosed_volumes[:n].sum(), 1e-9)
    same(kept.components(measured=True, order=4).areas, parts.areas[:n], 1e-9)
    sampled = kept.sample_points(500)["points"]
    nearest = np.min([abs(np.linalg.norm(sampled - c, axis=1) - r) for c, r in BALLS[:n]], axis=0)
    assert nearest.max() < 0.2 + atol
    assert len(kept.shell.cells) < len(whole.shell.cells)
    assert np.all(kept.bounds[0] >= whole.bounds[0]) and np.all(kept.bounds[1] <= whole.bounds[1])
    size = (60, 60)
    camera = isospline.camera_for(whole, size=size)
    image = isospline.render(scene, camera, size=size, layers=("depth",), light="phong")
    assert np.array_equal(np.isfinite(image.depth), np.isfinite(scene.cast_rays(camera.rays(size)).t_hit))


def test_a_clip_changes_nothing_that_is_kept_and_its_caps_are_those_of_the_largest():
    """A cut through two arms of one solid keeps both of them."""
    z, y, x = np.mgrid[0:24, 0:32, 0:32].astype(float)
    arms = np.maximum(4 - np.hypot(x - 8, y - 12), 4 - np.hypot(x - 23, y - 12))
    beam = np.minimum(4 - np.hypot(y - 12, z - 4), np.minimum(x - 5, 26 - x))
    speck = 2.5 - np.sqrt((x - 16) ** 2 + (y - 26) ** 2 + (z - 12) ** 2)
    samples = np.maximum(np.maximum(arms, beam), speck)
    samples = np.minimum(samples, np.minimum(z - 2, 21 - z))
    volume = isospline.Volume(samples)
    clip = isospline.HalfSpace((0, 0, 12), (0, 0, 1))
    cut = isospline.Isosurface(volume, 0.0, largest=1, clip=clip, capped=True)
    arms = cut.components(measured=True, order=4).enclosed_volumes
    assert len(arms) == 2 and arms.sum() == pytest.approx(cut.enclosed_volume(order=4).value)
    assert len(isospline.Isosurface(volume, 0.0).components().bounds) == 2  # the beam with its arms, and the speck
    assert cut.contains([(8, 12, 16), (23, 12, 16), (16, 26, 12.5)]).tolist() == [True, True, False]
    parts = cut.to_mesh().to_trimesh().split()
    assert len(parts) == 2 and all(part.is_watertight for part in parts)
    # Rays from below hit the caps of the arms, and nothing at the speck.
    hits = isospline.Scene(cut).cast_rays([(x, y, 0, 0, 0, 1) for x, y in ((8, 12), (23, 12), (16, 26))])
    np.testing.assert_allclose(hits.t_hit, [12, 12, np.inf])
    assert np.all(hits.primitive_ids[:2] == volume.cell_count)


@pytest.mark.slow
def test_a_mask_separates():
    """A mask cuts a bar into two parts of different size."""
    z, y, x = np.mgrid[0:16, 0:16, 0:40].astype(float)
    samples = np.minimum(4 - np.hypot(y - 8, z - 8), np.minimum(x - 3, 36 - x))
    for degree in (1, 2, 3):
        volume = isospline.Volume(samples, degree=degree)
        mask = np.ones(samples.shape, bool)
        mask[:, :, 14:16] = False
        assert len(isospline.Isosurface(volume, 0.0).components(measured=True, order=4).areas) == 1
        parted = isospline.Isosurface(volume, 0.0, mask=mask)
        parts = parted.components(measured=True, order=4)
        assert len(parts.areas) == 2
        kept = isospline.Isosurface(volume, 0.0, mask=mask, largest=1)
        assert kept.contains([(8, 8, 8), (25, 8, 8)]).tolist() == [False, True]
        assert kept.enclosed_volume(order=4).value == pytest.approx(parts.enclosed_volumes[0])


def test_another_level_has_its_own_largest():
    """Two balls, the larger one fainter: the level decides which of them is the largest."""
    size = 48
    z, y, x = np.mgrid[0:size, 0:size, 0:size].astype(float)
    faint = np.clip(14 - np.sqrt((x - 17) ** 2 + (y - 24) ** 2 + (z - 24) ** 2), 0, 4)
    bright = np.clip(9 - np.sqrt((x - 41) ** 2 + (y - 24) ** 2 + (z - 24) ** 2), 0, 8)
    surface = isospline.Isosurface(isospline.Volume(np.maximum(faint, bright), degree=1), 2.0, largest=1)
    scene = isospline.Scene(surface)
    points = [(17, 24, 24), (41, 24, 24)]
    rays = [(x, 24, -5, 0, 0, 1) for x in (17, 41)]
    assert surface.contains(points).tolist() == [True, False]
    assert np.isfinite(scene.cast_rays(rays).t_hit).tolist() == [True, False]
    surface.level = 5.0
    assert surface.contains(points).tolist() == [False, True]
    assert np.isfinite(scene.cast_rays(rays).t_hit).tolist() == [False, True]
    assert surface.with_level(2.0).contains(points).tolist() == [True, False]
    assert surface.with_level(2.0).largest == 1


def test_more_than_there_are_keeps_all_and_no_surface_has_none():
    whole = ball_surface()
    assert ball_surface(largest=100).enclosed_volume().value == whole.enclosed_volume().value
    with pytest.warns(UserWarning, match="empty|out of"):
        empty = isospline.Isosurface(whole.volume, 1e6, largest=2)
    found = empty.components(measured=True)
    assert found.areas.shape == (0,) and found.bounds.shape == (0, 2, 3)
    # A solid that fills the volume is a component without a surface.
    with pytest.warns(UserWarning, match="out of"):
        found = isospline.Isosurface(whole.volume, -1e6, largest=1).components(measured=True)
    assert found.enclosed_volumes == pytest.approx(48.0**3) and found.areas == 0


def test_pickles_and_copies_keep_it():
    surface = ball_surface(largest=2)
    for other in (pickle.loads(pickle.dumps(surface)), copy.copy(surface), copy.deepcopy(surface)):
        assert other.largest == 2
        assert other.enclosed_volume().value == surface.enclosed_volume().value


@pytest.mark.parametrize("given", [0, -1])
def test_a_number_that_keeps_nothing_is_refused(given):
    with pytest.raises(ValueError, match="^largest: expected a number of at least 1, or None"):
        ball_surface(largest=given)


def test_progress_cancels():
    with pytest.raises(isospline.Cancelled):
        ball_surface(largest=1, progress=lambda fraction: False)
    with pytest.raises(isospline.Cancelled):
        ball_surface().components(measured=True, progress=lambda fraction: False)
    seen = []
    ball_surface(largest=3, progress=seen.append)
    assert seen == sorted(seen) and seen[-1] == 1


def test_threads_that_change_the_level_see_one_level_at_a_time():
    """Rays down the middle of two balls; each of them is the largest at one of two levels."""
    size = 40
    z, y, x = np.mgrid[0:24, 0:24, 0:size].astype(float)
    faint = np.clip(9 - np.sqrt((x - 11) ** 2 + (y - 12) ** 2 + (z - 12) ** 2), 0, 3)
    bright = np.clip(6 - np.sqrt((x - 31) ** 2 + (y - 12) ** 2 + (z - 12) ** 2), 0, 6)
    surface = isospline.Isosurface(isospline.Volume(np.maximum(faint, bright), degree=1), 2.0, largest=1)
    scene = isospline.Scene(surface)
    rays = [(x, 12, -5, 0, 0, 1) for x in (11, 31)]
    stop, wrong = threading.Event(), []

    def look():
        while not stop.is_set():
            if np.isfinite(scene.cast_rays(rays).t_hit).sum() != 1:
                wrong.append(1)

    threads = [threading.Thread(target=look) for _ in range(2)]
    for thread in threads:
        thread.start()
    for i in range(40):
        surface.level = (2.0, 4.0)[i % 2]
    stop.set()
    for thread in threads:
        thread.join()
    assert not wrong


@pytest.mark.parametrize("axes", ["zyx", "xyz"])
@pytest.mark.parametrize("degree", [1, 2, 3])
def test_the_mask_of_a_piece_keeps_what_is_in_it(degree, axes):
    samples = ball_samples() if axes == "zyx" else ball_samples().transpose()
    volume = isospline.Volume(samples, degree=degree, axes=axes)
    whole = isospline.Isosurface(volume, 0.0)
    pieces = whole.components()
    largest = isospline.Isosurface(volume, 0.0, largest=1)
    mask = largest.to_mask(whole_cells=True)
    assert mask.shape == samples.shape and mask.dtype == bool
    inner = isospline.Isosurface(volume, 1.0)  # a smaller ball in each of the balls
    kept = isospline.Isosurface(volume, 1.0, mask=mask)
    points = np.random.default_rng(2).uniform(0, 47, (20000, 3))
    np.testing.assert_array_equal(kept.contains(points), inner.contains(points) & largest.contains(points))
    assert len(kept.components().bounds) == 1 < len(pieces.bounds)
    if degree == 1:  # SciPy's labels of the samples above the level; cells have samples at their corners
        labels, counts = solid_labels(ball_samples())
        of_cells = ndimage.binary_dilation(labels == 1 + counts.argmax(), np.ones((3, 3, 3)))
        np.testing.assert_array_equal(mask if axes == "zyx" else mask.transpose(), of_cells)
    below = isospline.Isosurface(volume, 0.0, inside="below").to_mask(whole_cells=True)
    above = whole.to_mask(whole_cells=True)
    assert (below | above).all()
    with pytest.raises(Exception, match="cancelled"):
        whole.to_mask(whole_cells=True, progress=lambda done: False)


def test_the_command_line_lists_and_keeps_them(tmp_path, capsys):
    path = tmp_path / "balls.npy"
    samples = ball_samples().astype("f4")
    np.save(path, samples)
    assert main(["measure", str(path), "--level", "0", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["components"]
    whole = isospline.Isosurface(isospline.Volume(samples), 0.0).components(measured=True)
    np.testing.assert_allclose(found["enclosed_volumes"], whole.enclosed_volumes, rtol=1e-4)
    np.testing.assert_allclose(found["bounds"], whole.bounds)
    assert main(["measure", str(path), "--level", "0", "--largest", "2"]) == 0
    text = capsys.readouterr().out
    assert "components           2" in text
    assert main(["mesh", str(path), "--level", "0", "--largest", "3", "-o", str(tmp_path / "a.stl")]) == 0
    assert len(trimesh.load(tmp_path / "a.stl").split()) == 3
    picture = ["render", str(path), "--level", "0", "--size", "64x64", "--view", "front", "-o"]
    assert main([*picture, str(tmp_path / "all.exr")]) == 0
    assert main([*picture, str(tmp_path / "one.exr"), "--largest", "1"]) == 0
    assert main([*picture, str(tmp_path / "none.exr"), "--largest", "0"]) == 2
    assert "largest: expected a number of at least 1" in capsys.readouterr().err
