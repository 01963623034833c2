"""The shell against its slow definition, cutouts, levels and bad input."""

import itertools
import threading

import numpy as np
import pytest
import shell_definition

import isospline

BORDER_RULES = (True, False)


def random_data(rng, shape):
    """float32 noise that includes -1 and 1: coefficients are then stored without an offset."""
    data = rng.uniform(-0.99, 0.99, shape).astype(np.float32)
    data.flat[0], data.flat[-1] = -1, 1
    return data


def analytic_volume(degree, size=20, **options):
    """A torus and specks next to it."""
    z, y, x = np.mgrid[-1 : 1 : size * 1j, -1 : 1 : (size + 3) * 1j, -1 : 1 : (size + 5) * 1j]
    data = (np.hypot(x, y) - 0.6) ** 2 + z**2 - 0.05 + 0.03 * np.cos(7 * x * z + y)
    return isospline.Volume((data / np.abs(data).max()).astype(np.float32), degree=degree, **options)


def assert_is_shell(surface, expected):
    shell = surface.shell
    np.testing.assert_array_equal(shell.mask, expected)
    assert shell.count == len(shell) == np.count_nonzero(expected)
    in_order_of_axes = shell.cells[:, ::-1] if surface.volume.axes == "zyx" else shell.cells
    assert {tuple(cell) for cell in in_order_of_axes} == {tuple(cell) for cell in np.argwhere(expected)}


@pytest.mark.sweep(9)
@pytest.mark.slow
@pytest.mark.parametrize("prune_depth", range(5))
@pytest.mark.parametrize("boundary", ["mirror", "periodic"])
@pytest.mark.parametrize("degree", [1, 2, 3])
def test_random_volumes_have_the_shell_of_the_definition(rng, degree, boundary, prune_depth):
    for shape in [(9, 10, 11), (8, 16, 8), (2, 3, 17), (2, 2, 2)]:
        for filter in ("interpolate", "none"):
            volume = isospline.Volume(random_data(rng, shape), degree=degree, boundary=boundary, filter=filter)
            for prune_border in BORDER_RULES:
                options = {"prune_depth": prune_depth, "prune_border": prune_border}
                surface = isospline.research.isosurface(volume, 0.25, **options)
                assert_is_shell(surface, shell_definition.shell(volume, 0.25, **options))


@pytest.mark.sweep(8)
@pytest.mark.slow
@pytest.mark.parametrize("prune_depth", range(5))
@pytest.mark.parametrize("degree", [1, 2, 3])
def test_analytic_volumes_have_the_shell_of_the_definition(degree, prune_depth):
    volume = analytic_volume(degree, size=20 if prune_depth < 3 else 10)
    for prune_border in BORDER_RULES:
        options = {"prune_depth": prune_depth, "prune_border": prune_border}
        for level in (0.0, 0.01):
            surface = isospline.research.isosurface(volume, level, **options)
            assert 0 < surface.shell.count < surface.shell.mask.size
            assert_is_shell(surface, shell_definition.shell(volume, level, **options))


@pytest.mark.parametrize("shape", [(1, 1, 5), (1, 4, 1), (3, 1, 1), (1, 2, 2)])
def test_volumes_one_sample_thick_have_a_shell(rng, shape):
    volume = isospline.Volume(random_data(rng, shape))
    for prune_depth in range(4):
        surface = isospline.research.isosurface(volume, 0.0, prune_depth=prune_depth)
        assert_is_shell(surface, shell_definition.shell(volume, 0.0, prune_depth=prune_depth))


@pytest.mark.parametrize("prune_depth", range(4))
@pytest.mark.parametrize("degree", [1, 2, 3])
def test_coefficients_equal_to_the_level_count_as_above(rng, degree, prune_depth):
    # Few values: many sub-cells have coefficients of zero; float32 alone cannot distinguish these from small ones.
    data = rng.integers(0, 5, (11, 12, 13), dtype=np.uint8)
    data.flat[0], data.flat[-1] = 0, 4
    volume = isospline.Volume(data, degree=degree, filter="none")
    for level in (1.0, 2.0, 3.0):
        surface = isospline.research.isosurface(volume, level, prune_depth=prune_depth)
        assert_is_shell(surface, shell_definition.shell(volume, level, prune_depth=prune_depth))


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_flat_parts_at_the_level_have_the_shell_of_the_definition(rng, degree):
    # A plateau exactly at the level, with pits of different depths: pruning depends on exact zeros.
    data = np.zeros((12, 12, 12), dtype=np.float32)
    pits = rng.integers(0, 12, (40, 3))
    data[tuple(pits.T)] = -(2.0 ** -rng.integers(0, 12, 40))
    data[0, 0, 0] = 1
    data[-1, -1, -1] = -1
    volume = isospline.Volume(data, degree=degree, filter="none")
    for prune_depth in (1, 2, 3):
        surface = isospline.research.isosurface(volume, 0.0, prune_depth=prune_depth)
        assert_is_shell(surface, shell_definition.shell(volume, 0.0, prune_depth=prune_depth))


@pytest.mark.parametrize("degree", [1, 2, 3])
@pytest.mark.parametrize("prune_depth", [0, 2, 4, 6])
def test_no_surface_lies_outside_of_the_shell(rng, degree, prune_depth):
    volume = isospline.Volume(random_data(rng, (7, 8, 9)), degree=degree)
    surface = isospline.research.isosurface(volume, 0.125, prune_depth=prune_depth)

    steps = 6
    shift = 0.5 if degree % 2 == 0 else 0.0
    cells = np.array(surface.shell.mask.shape)
    axes = [np.arange(count * steps + 1) / steps - shift for count in cells]
    z, y, x = np.meshgrid(*axes, indexing="ij")
    values = volume.sample(np.stack([x, y, z], axis=-1)) - 0.125
    crossed = shell_definition.in_windows(np.any, values < -1e-9, steps + 1, steps)
    crossed &= shell_definition.in_windows(np.any, values > 1e-9, steps + 1, steps)
    assert crossed.any()
    assert not np.any(crossed & ~surface.shell.mask)


def test_deeper_pruning_leaves_fewer_cells():
    volume = analytic_volume(2)
    masks = [isospline.research.isosurface(volume, 0.0, prune_depth=depth).shell.mask for depth in range(7)]
    for coarse, fine in itertools.pairwise(masks):
        assert not np.any(fine & ~coarse)
    assert masks[6].sum() < 0.8 * masks[0].sum()


def test_cells_are_ordered_by_octet_then_brick_then_block_then_z_y_x(rng):
    surface = isospline.Isosurface(isospline.Volume(random_data(rng, (19, 20, 21))), 0.0)
    cells = surface.shell.cells
    assert cells.dtype == np.int32 and cells.shape == (surface.shell.count, 3)
    x, y, z = cells.T
    keys = [axis // edge % count for edge, count in ((1, 2), (2, 4), (8, 2), (16, 2)) for axis in (x, y, z)]
    order = np.lexsort(keys)
    np.testing.assert_array_equal(order, np.arange(len(cells)))


def test_order_of_axes_follows_the_data(rng):
    data = random_data(rng, (9, 10, 12))
    mask = rng.uniform(size=data.shape) < 0.8
    zyx = isospline.Isosurface(isospline.Volume(data), 0.1, mask=mask)
    xyz = isospline.Isosurface(isospline.Volume(data.T, axes="xyz"), 0.1, mask=mask.T)
    assert xyz.shell.mask.shape == (12, 10, 9)
    np.testing.assert_array_equal(xyz.shell.cells, zyx.shell.cells)
    np.testing.assert_array_equal(xyz.shell.mask, zyx.shell.mask.T)


# Levels


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_another_level_gives_the_shell_of_a_new_surface(rng, degree):
    volume = isospline.Volume(random_data(rng, (17, 9, 12)), degree=degree)
    surface = isospline.Isosurface(volume, 0.9)
    for level in (-0.7, 0.0, 0.3, 0.9):
        fresh = isospline.Isosurface(volume, level)
        surface.level = level
        assert surface.level == level
        np.testing.assert_array_equal(surface.shell.cells, fresh.shell.cells)
        np.testing.assert_array_equal(fresh.with_level(0.5).with_level(level).shell.cells, fresh.shell.cells)


def test_with_level_keeps_the_options(rng):
    data = random_data(rng, (9, 9, 9))
    options = {"prune_depth": 3, "prune_border": False, "mask": data < 0.5, "clip": isospline.Box([1] * 3, [6] * 3)}
    surface = isospline.research.isosurface(isospline.Volume(data), 0.2, method="bracket", inside="below", **options)
    other = surface.with_level(-0.2)
    assert (other.level, surface.level) == (-0.2, 0.2)
    assert (other.method, other.inside, other.prune_depth, other.prune_border) == ("bracket", "below", 3, False)
    assert other.volume is surface.volume
    expected = isospline.research.isosurface(surface.volume, -0.2, **options).shell.cells
    np.testing.assert_array_equal(other.shell.cells, expected)


def test_level_between_two_floats(rng):
    # The threshold is not a float32: the coefficients are its neighbours on both sides.
    data = np.full((6, 6, 6), np.float32(0.1))
    data[2:4, 2:4, 2:4] = np.nextafter(np.float32(0.1), np.float32(1))
    data[0, 0, 0], data[-1, -1, -1] = -1, 1
    volume = isospline.Volume(data, filter="none")
    level = (float(data[1, 1, 1]) + float(data[2, 2, 2])) / 2
    for prune_depth in range(3):
        surface = isospline.research.isosurface(volume, level, prune_depth=prune_depth)
        assert_is_shell(surface, shell_definition.shell(volume, level, prune_depth=prune_depth))


@pytest.mark.parametrize("level", [-1.5, 300.0])
def test_level_out_of_range_warns_and_leaves_no_cells(level):
    volume = isospline.Volume(np.mgrid[0:5, 0:5, 0:256][2])
    with pytest.warns(UserWarning, match=rf"level {level:g} is out of the data's range, 0 to 255"):
        surface = isospline.Isosurface(volume, level)
    assert surface.shell.count == 0
    assert surface.shell.cells.shape == (0, 3)
    assert not surface.shell.mask.any()
    surface.level = 100
    assert surface.shell.count > 0
    with pytest.warns(UserWarning, match="out of the data's range"):
        surface.level = level


def test_shell_emptied_by_a_cutout_warns(rng):
    volume = isospline.Volume(random_data(rng, (5, 5, 5)))
    with pytest.warns(UserWarning, match="level 0 has an empty shell"):
        isospline.Isosurface(volume, 0.0, mask=np.zeros((5, 5, 5), dtype=bool))


@pytest.mark.parametrize("level", [np.nan, np.inf, -np.inf])
def test_level_must_be_finite(rng, level):
    volume = isospline.Volume(random_data(rng, (5, 5, 5)))
    with pytest.raises(ValueError, match="level: expected a finite number"):
        isospline.Isosurface(volume, level)
    surface = isospline.Isosurface(volume, 0.0)
    before = surface.shell.cells
    with pytest.raises(ValueError, match="level: expected a finite number"):
        surface.level = level
    assert surface.level == 0.0
    np.testing.assert_array_equal(surface.shell.cells, before)


# Cutouts


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_mask_keeps_cells_by_their_samples(rng, degree):
    volume = isospline.Volume(random_data(rng, (9, 10, 11)), degree=degree)
    mask = rng.uniform(size=(9, 10, 11)) < 0.9
    expected = shell_definition.cut_by_mask(shell_definition.shell(volume, 0.1), mask, degree)
    assert_is_shell(isospline.Isosurface(volume, 0.1, mask=mask), expected)
    assert_is_shell(isospline.Isosurface(volume, 0.1, mask=np.asfortranarray(mask)), expected)
    assert_is_shell(isospline.Isosurface(volume, 0.1, mask=np.ones_like(mask)), shell_definition.shell(volume, 0.1))


def cell_corners(surface, cells):
    """World positions of the eight corners of cells, (M, 8, 3)."""
    volume = surface.volume
    offsets = np.stack(np.meshgrid([0, 1], [0, 1], [0, 1], indexing="ij"), axis=-1).reshape(8, 3)
    index = cells[:, None, :] + offsets - (0.5 if volume.degree % 2 == 0 else 0.0)
    return index @ volume.affine[:3, :3].T + volume.affine[:3, 3]


@pytest.mark.parametrize("degree", [1, 2])
def test_clip_drops_cells_wholly_outside(rng, degree):
    direction, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    placed = {"spacing": (0.5, 1.25, 2.0), "origin": (10, -20, 5), "direction": direction}
    volume = isospline.Volume(random_data(rng, (17, 18, 19)), degree=degree, **placed)
    whole = isospline.Isosurface(volume, 0.1)
    corners = cell_corners(whole, whole.shell.cells)
    middle = volume.bounds.mean(axis=0)

    for length in (1e-200, 1.0, 1e200):
        normal = rng.normal(size=3)
        inside = ((corners - middle) @ normal >= 0).any(axis=1)
        assert 0 < np.count_nonzero(inside) < len(inside)
        half = isospline.Isosurface(volume, 0.1, clip=isospline.HalfSpace(middle, normal * length))
        np.testing.assert_array_equal(half.shell.cells, whole.shell.cells[inside])

    box = isospline.Box(middle - (2, 3, 4), middle + (4, np.inf, 3))
    inside = np.ones(len(corners), dtype=bool)
    for axis in range(3):
        inside &= (corners[:, :, axis] >= box.minimum[axis]).any(axis=1)
        inside &= (corners[:, :, axis] <= box.maximum[axis]).any(axis=1)
    assert 0 < np.count_nonzero(inside) < len(inside)
    boxed = isospline.Isosurface(volume, 0.1, clip=box)
    np.testing.assert_array_equal(boxed.shell.cells, whole.shell.cells[inside])

    both = isospline.Isosurface(volume, 0.1, clip=[box, isospline.HalfSpace(middle, (0, 1, 0))])
    inside &= (corners[:, :, 1] >= middle[1]).any(axis=1)
    np.testing.assert_array_equal(both.shell.cells, whole.shell.cells[inside])


def test_clip_shapes_describe_themselves():
    half_space = isospline.HalfSpace((1, 2.5, 3), normal=[0, 0, -2])
    box = isospline.Box(minimum=(0, 0, -np.inf), maximum=(1, 2, 3))
    assert repr(half_space) == "HalfSpace(point=(1, 2.5, 3), normal=(0, 0, -2))"
    assert repr(box) == "Box(minimum=(0, 0, -inf), maximum=(1, 2, 3))"
    np.testing.assert_array_equal(half_space.point, (1, 2.5, 3))
    np.testing.assert_array_equal(half_space.normal, (0, 0, -2))
    np.testing.assert_array_equal(box.minimum, (0, 0, -np.inf))
    np.testing.assert_array_equal(box.maximum, (1, 2, 3))


@pytest.mark.parametrize(
    "make, message",
    [
        (lambda: isospline.HalfSpace((0, 0, np.nan), (0, 0, 1)), "point: expected three finite numbers"),
        (lambda: isospline.HalfSpace((0, 0, 0), (0, 0, 0)), "normal: .* not all of them zero"),
        (lambda: isospline.HalfSpace((0, 0, 0), (0, np.inf, 0)), "normal: expected three finite numbers"),
        (lambda: isospline.HalfSpace((0, 0), (0, 0, 1)), "point: expected shape"),
        (lambda: isospline.Box((0, 0, 0), (1, 1, -1)), "maximum: expected numbers above those of the minimum"),
        (lambda: isospline.Box((0, 0, 0), (1, 0, 1)), "maximum: expected numbers above those of the minimum"),
        (lambda: isospline.Box((0, np.nan, 0), (1, 1, 1)), "maximum: expected numbers above those of the minimum"),
    ],
)
def test_clip_shapes_check_their_numbers(make, message):
    with pytest.raises(ValueError, match=message):
        make()


# Other input


@pytest.mark.parametrize(
    "options, error, message",
    [
        ({"prune_depth": -1}, ValueError, "prune_depth: expected 0 to 6, got -1"),
        ({"prune_depth": 7}, ValueError, "prune_depth: expected 0 to 6, got 7"),
        ({"mask": np.ones((4, 5, 7), dtype=bool)}, ValueError, r"mask: expected shape \(4, 5, 6\)"),
        ({"mask": np.ones((4, 5, 6), dtype=np.uint8)}, TypeError, "mask: expected an array of bool"),
        ({"clip": "left"}, TypeError, "clip: expected a HalfSpace, a Box"),
        ({"clip": [isospline.Box((0, 0, 0), (1, 1, 1)), 3]}, TypeError, "clip: expected a HalfSpace, a Box"),
        ({"method": "guess"}, ValueError, 'method: expected "exact" or "reference" or "bracket", got "guess"'),
        ({"inside": "out"}, ValueError, 'inside: expected "above" or "below", got "out"'),
        ({"depth": 2}, TypeError, "depth: expected a parameter of Isosurface .*"),
    ],
)
def test_options_are_checked(rng, options, error, message):
    volume = isospline.Volume(random_data(rng, (4, 5, 6)))
    with pytest.raises(error, match=message):
        isospline.research.isosurface(volume, 0.0, **options)


@pytest.mark.parametrize("degree", [0, 4, 5])
def test_degree_must_have_an_intersector(rng, degree):
    volume = isospline.Volume(random_data(rng, (4, 5, 6)), degree=degree)
    with pytest.raises(ValueError, match="volume: expected a degree of 1, 2 or 3"):
        isospline.Isosurface(volume, 0.0)


@pytest.mark.parametrize("degree", [1, 3])
def test_odd_degrees_need_two_samples(rng, degree):
    volume = isospline.Volume(random_data(rng, (4, 1, 6)), degree=degree)
    with pytest.raises(ValueError, match="volume: expected at least two samples along each axis"):
        isospline.Isosurface(volume, 0.0)


def test_volume_must_be_one():
    for volume in (None, np.zeros((3, 3)), "volume", 3):
        with pytest.raises(TypeError, match="^volume: expected a Volume, a VolumeData or"):
            isospline.Isosurface(volume, 0.0)


def test_volumes_may_be_data_and_arrays(rng):
    data = random_data(rng, (4, 5, 6)).astype(np.float32)
    for given, spacing in ((data, 1.0), (isospline.VolumeData(data, spacing=(1, 2, 3)), (1, 2, 3))):
        surface = isospline.Isosurface(given, 0.25)
        np.testing.assert_array_equal(surface.volume.spacing, np.broadcast_to(spacing, 3))
        np.testing.assert_array_equal(surface.volume.coefficients, isospline.Volume(data).coefficients)


@pytest.mark.parametrize("capped", [False, True])
def test_bounds_are_those_of_a_scene(rng, capped):
    volume = isospline.Volume(random_data(rng, (7, 8, 9)), spacing=(1, 2, 0.5), origin=(3, 4, 5))
    surface = isospline.Isosurface(volume, 0.25, clip=isospline.HalfSpace((6, 0, 0), (1, 1, 0)), capped=capped)
    np.testing.assert_allclose(surface.bounds, isospline.Scene(surface).bounds, atol=1e-6)
    assert (surface.bounds[0] >= volume.bounds[0]).all() and (surface.bounds[1] <= volume.bounds[1]).all()
    with pytest.warns(UserWarning, match="there is no surface"):
        assert np.isinf(isospline.Isosurface(volume, 1e6).bounds).all()
    camera = isospline.camera_for(surface, view="front")
    assert camera == isospline.camera_for(surface.bounds, view="front")


def test_properties_are_those_given(rng):
    volume = isospline.Volume(random_data(rng, (4, 5, 6)))
    surface = isospline.Isosurface(volume, 0.25)
    assert surface.volume is volume
    assert (surface.level, surface.method, surface.inside) == (0.25, "exact", "above")
    assert (surface.prune_depth, surface.prune_border) == (2, True)
    assert surface.shell.memory == 6 * surface.shell.count
    assert repr(surface).startswith('<Isosurface(level=0.25, inside="above")')
    assert repr(surface.shell) == f"<Shell of {surface.shell.count} cells>"


def test_surface_outlives_the_names_of_its_parts(rng):
    shell = isospline.Isosurface(isospline.Volume(random_data(rng, (9, 9, 9))), 0.0).shell
    assert shell.mask.sum() == shell.count


def test_progress_gets_fractions(rng):
    fractions = []
    volume = isospline.Volume(random_data(rng, (40, 40, 40)))
    isospline.Isosurface(volume, 0.0, progress=fractions.append).with_level(0.1, progress=fractions.append)
    assert all(0 <= fraction <= 1 for fraction in fractions)


def test_surfaces_of_one_volume_are_built_by_several_threads(rng):
    volume = isospline.Volume(random_data(rng, (24, 24, 24)))
    levels = [-0.4, -0.1, 0.2, 0.5]
    expected = [isospline.Isosurface(volume, level).shell.cells for level in levels]
    found = [None] * len(levels)

    def build(i):
        found[i] = isospline.Isosurface(volume, levels[i]).shell.cells

    threads = [threading.Thread(target=build, args=[i]) for i in range(len(levels))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for i in range(len(levels)):
        np.testing.assert_array_equal(found[i], expected[i])
