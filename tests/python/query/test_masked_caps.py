"""Caps that end at cells that a mask removes: nearest points, areas and samples, against dense points of the caps.

Lattice space is that of cells: cell i goes from i to i + 1.
"""

import numpy as np
import pytest
import scipy.ndimage
import scipy.spatial

import isospline

# Masks and clips may leave nothing.
pytestmark = pytest.mark.filterwarnings("ignore:level .* (has an empty shell|is out of the data's range)")

LEVEL = 0.5


def unit(axis, sign=1.0):
    return sign * np.eye(3)[axis]


def shift_of(degree):
    """Sample coordinates minus lattice coordinates."""
    return -0.5 if degree == 2 else 0.0


def kept_cells(mask, degree):
    """The cells that a mask keeps: for odd degrees, those with all corners True."""
    if degree == 2:
        return mask
    return scipy.ndimage.minimum_filter(mask, size=2, origin=-1, mode="nearest")[:-1, :-1, :-1]


def random_mask(rng, shape):
    """A mask with one or two straight borders, holes, or noise."""
    mask = np.ones(shape, bool)
    way = rng.choice(["border", "borders", "noise", "holes", "box"])
    if way == "noise":
        mask = rng.random(shape) < rng.uniform(0.5, 0.99)
    elif way == "holes":
        mask.ravel()[rng.integers(0, mask.size, 3)] = False
    elif way == "box":
        first = rng.integers(0, np.array(shape) - 1)
        mask[tuple(slice(i, rng.integers(i + 1, n + 1)) for i, n in zip(first, shape, strict=True))] = False
    else:
        for _ in range(1 if way == "border" else 2):
            axis = rng.integers(3)
            place = int(rng.integers(1, shape[axis]))
            parts = [slice(None)] * 3
            parts[axis] = slice(place, None) if rng.random() < 0.5 else slice(None, place)
            mask[tuple(parts)] = False
    return mask


def random_plane(rng, cells):
    """The normal and a point of a plane: on faces of cells, in their middle, anywhere across an axis, or oblique."""
    way = rng.random()
    if way < 0.6:
        normal = unit(rng.integers(3), rng.choice([-1.0, 1.0]))
        offset = rng.choice(
            [rng.integers(0, max(cells)), rng.integers(0, 2 * max(cells)) / 2, rng.uniform(0, max(cells))]
        )
        return normal, abs(normal) * offset
    if way < 0.8:
        normal = rng.choice([-1.0, 1.0], 3) * (rng.permutation(3) > 0)
        return normal / np.linalg.norm(normal), rng.integers(0, cells + 1).astype(float)
    normal = rng.normal(size=3)
    return normal / np.linalg.norm(normal), rng.uniform(0, 1, 3) * cells


class Case:
    """A random solid and what is known about it without the code under test. Arrays are in the order x, y, z."""

    def __init__(self, rng, degree):
        shape = rng.integers(4, 12, 3)
        self.cells = shape if degree == 2 else shape - 1
        self.shift = shift_of(degree)
        self.degree = degree
        self.spacing = np.ones(3) if rng.random() < 0.5 else np.round(rng.uniform(0.3, 2, 3), 2)
        self.origin = rng.choice([0, 1, 100, 1e4]) * rng.uniform(-1, 1, 3)
        field = rng.choice(["constant", "noise", "linear"])
        self.samples = np.ones(shape)
        if field == "noise":
            self.samples += rng.uniform(0, 0.1, shape)
        if field == "linear":
            gradient = rng.normal(size=3) if rng.random() < 0.5 else unit(rng.integers(3), rng.choice([-1.0, 1.0]))
            middle = rng.uniform(0, 1, 3) * (shape - 1)
            self.samples = np.moveaxis(np.indices(shape), 0, -1) @ gradient + LEVEL - gradient @ middle
        self.is_full = field != "linear"
        self.volume = isospline.Volume(
            np.ascontiguousarray(self.samples.T), degree=degree, spacing=self.spacing, origin=self.origin
        )
        mask = random_mask(rng, shape)
        self.kept = kept_cells(mask, degree)
        closed = bool(rng.random() < 0.4)
        given = [random_plane(rng, self.cells) for _ in range(rng.integers(0 if closed else 1, 4))]
        capped = bool(given) and (not closed or rng.random() < 0.7)
        clip = [isospline.HalfSpace(self.to_world(point), normal / self.spacing) for normal, point in given]
        self.surface = isospline.Isosurface(
            self.volume, LEVEL, mask=mask.T, clip=clip or None, capped=capped, closed=closed
        )
        self.clip = [(normal, normal @ point) for normal, point in given]
        self.border = [(unit(axis), 0.0) for axis in range(3)]
        self.border += [(unit(axis, -1.0), -float(self.cells[axis])) for axis in range(3)]
        self.caps = (self.clip if capped else []) + (self.border if closed else [])
        self.numbered = self.clip + [
            (sign * unit(a), offset) for a in range(3) for sign, offset in ((1.0, 0.0), (-1.0, -float(self.cells[a])))
        ]

    def to_world(self, lattice):
        return self.origin + (lattice + self.shift) * self.spacing

    def to_lattice(self, world):
        return (world - self.origin) / self.spacing - self.shift

    def value(self, lattice):
        if self.is_full:
            return np.ones(len(lattice))
        samples = (lattice + self.shift).T
        return scipy.ndimage.map_coordinates(self.samples, samples, order=self.degree, mode="mirror")

    def is_within(self, lattice, slack):
        """Whether points are in the clip and the domain."""
        return np.all([lattice @ n >= offset - slack for n, offset in self.clip + self.border], axis=0)

    def is_kept(self, lattice):
        cells = np.floor(lattice).astype(int)
        is_in = ((cells >= 0) & (cells < self.cells)).all(axis=1)
        return is_in & self.kept[tuple(np.clip(cells, 0, self.cells - 1).T)]

    def dense_points(self):
        """Points of all caps: those of a grid in each plane that are in a kept cell on its inner side."""
        found = [np.empty((0, 3))]
        for normal, offset in self.caps:
            if abs(normal).max() == 1:
                axis = int(abs(normal).argmax())
                ways = [
                    np.concatenate([np.arange(0, n + 1e-9, 0.25), np.arange(n) + 1e-6, np.arange(n) + 1 - 1e-6])
                    for n in self.cells
                ]
                ways[axis] = np.array([abs(offset)])
                points = np.stack(np.meshgrid(*ways), axis=-1).reshape(-1, 3)
            else:
                reach = np.linalg.norm(self.cells) / 2
                across = np.linalg.svd(normal[None])[2][1:]
                middle = self.cells / 2 + (offset - normal @ self.cells / 2) * normal
                ways = np.linspace(-reach, reach, 100)
                points = middle + np.stack(np.meshgrid(ways, ways), axis=-1).reshape(-1, 2) @ across
            inner = points + 1e-7 * normal
            others = [(n, o) for n, o in self.clip + self.border if not np.array_equal(n, normal) or o != offset]
            is_cap = np.all([points @ n > o + 1e-7 for n, o in others], axis=0) & self.is_kept(inner)
            points = points[is_cap]
            found.append(points[self.value(points) >= LEVEL + 2e-5])
        return np.concatenate(found)

    def has_cap_at(self, lattice, number, slack=1e-6):
        """Whether a point is within `slack` of the cap with this number, in a kept cell within the clip."""
        normal, offset = self.numbered[number]
        if abs(lattice @ normal - offset) > slack or not self.is_within(lattice[None], slack)[0]:
            return False
        first, last = np.floor(lattice - slack).astype(int), np.floor(lattice + slack).astype(int)
        around = [np.arange(max(a, 0), min(b, n - 1) + 1) for a, b, n in zip(first, last, self.cells, strict=True)]
        cells = [cell for cell in np.stack(np.meshgrid(*around), axis=-1).reshape(-1, 3) if self.kept[tuple(cell)]]
        is_in_solid = any(all((cell + (n > 0)) @ n - o > 1e-8 for n, o in self.clip) for cell in cells)
        return is_in_solid and self.value(lattice[None])[0] >= LEVEL - 2e-5

    def points_about(self, rng, count):
        """Points in and about the domain, many of them exactly on planes of samples, half-samples and the clip."""
        points = rng.uniform(-0.3, 1.3, (count, 3)) * self.cells
        is_special = rng.random((count, 3)) < rng.choice([0, 0.5, 1], count)[:, None]
        points = np.where(is_special, rng.integers(-2, 2 * self.cells.max() + 3, (count, 3)) / 2, points)
        if self.clip:
            normal, offset = self.clip[0]
            points[::4] -= ((points[::4] @ normal) - offset)[:, None] * normal
        return points


@pytest.mark.sweep(1)
@pytest.mark.parametrize("degree", [1, 2, 3])
def test_nearest_points_are_those_of_dense_points_of_caps(rng, degree):
    """No point of a cap is nearer than the result, and the result is a point of a cap or of the isosurface."""
    on_caps = 0
    for _ in range(60):
        case = Case(rng, degree)
        points = case.to_world(case.points_about(rng, 80))
        nearest = case.surface.closest_points(points)
        dense = case.dense_points()
        rounding = 1e-6 + 1e-9 * abs(case.origin).max()
        if len(dense) > 0:
            bound = scipy.spatial.cKDTree(case.to_world(dense)).query(points)[0]
            assert (nearest.distances <= bound + rounding).all()
        elif case.is_full:
            assert np.isinf(nearest.distances).all()
        is_cap = np.isfinite(nearest.distances) & (nearest.primitive_ids >= case.volume.cell_count)
        numbers = (nearest.primitive_ids[is_cap] - case.volume.cell_count).astype(int)
        for lattice, number in zip(case.to_lattice(nearest.points[is_cap]), numbers, strict=True):
            assert case.has_cap_at(lattice, number)
        on_caps += is_cap.sum()
    assert on_caps > 1000


@pytest.mark.parametrize("degree", [1, 2, 3])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_caps_on_faces_of_cells_end_at_the_mask(rng, degree, sign):
    """A plane between two layers of cells, of which one is in the clip, and borders of masks in all directions."""
    shift = shift_of(degree)
    samples = 1 + rng.uniform(0, 0.1, (12, 12, 12))
    for across in range(3):
        for along in (axis for axis in range(3) if axis != across):
            for is_upper in (False, True):
                mask = np.ones((12, 12, 12), bool)
                np.moveaxis(mask, 2 - along, 0)[slice(7, None) if is_upper else slice(None, 5)] = False
                clip = isospline.HalfSpace((8 + shift) * unit(across), unit(across, sign))
                surface = isospline.Isosurface(
                    isospline.Volume(samples, degree=degree), LEVEL, mask=mask, clip=clip, capped=True
                )
                lower, upper = np.full(3, shift), np.full(3, 11 - shift)
                lower[across] = upper[across] = 8 + shift
                if is_upper:
                    upper[along] = 6.5 if degree == 2 else 6.0
                else:
                    lower[along] = 4.5 if degree == 2 else 5.0
                points = np.concatenate([rng.uniform(-2, 14, (50, 3)), rng.integers(-4, 28, (100, 3)) / 2])
                expected = np.clip(points, lower, upper)
                np.testing.assert_allclose(surface.closest_points(points).points, expected, atol=1e-12)


@pytest.mark.parametrize("degree", [1, 3])
def test_a_point_above_the_border_of_a_mask_is_near_the_cap(degree):
    volume = isospline.Volume(np.ones((12, 12, 12)), degree=degree)
    mask = np.ones(volume.shape, bool)
    mask[:, :, 7:] = False
    clip = isospline.HalfSpace((0, 8, 0), (0, -1, 0))
    surface = isospline.Isosurface(volume, LEVEL, mask=mask, clip=clip, capped=True)
    nearest = surface.closest_points([(6.0, 8.2, 4.6), (6.3, 8.4, 4.6)])
    np.testing.assert_allclose(nearest.distances, [0.2, 0.5])
    np.testing.assert_allclose(surface.signed_distance([(6.3, 7.6, 4.6)]), [0.5])
    assert surface.thickness((3, 8, 4.6), method="ray") == np.inf  # open at the far end
    np.testing.assert_allclose(isospline.Scene([surface]).closest_points([(6.3, 8.4, 4.6)]).distances, [0.5])


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_masks_that_remove_all_of_the_clip_leave_no_caps(rng, degree):
    """The mask keeps only cells beyond a plane of the clip. Other planes of the clip have no caps at its border."""
    for _ in range(60):
        cells = rng.integers(4, 10, 3)
        shape = cells if degree == 2 else cells + 1
        axis, is_upper = rng.integers(3), rng.random() < 0.5
        place = int(rng.integers(2, cells[axis] - 1))
        mask = np.zeros(shape, bool)
        np.moveaxis(mask, axis, 0)[
            slice(place, None) if is_upper else slice(None, place + shape[axis] - cells[axis])
        ] = True
        assert kept_cells(mask, degree).any()
        spacing = np.round(rng.uniform(0.3, 2, 3), 2)
        origin = rng.choice([0, 1e4, 1e6]) * rng.uniform(-1, 1, 3)

        def to_world(lattice, spacing=spacing, origin=origin):
            return origin + (lattice + shift_of(degree)) * spacing

        planes = [(unit(axis, -1.0 if is_upper else 1.0), place * unit(axis))]
        planes += [random_plane(rng, cells) for _ in range(rng.integers(1, 4))]
        surface = isospline.Isosurface(
            isospline.Volume(np.ones(shape[::-1]), degree=degree, spacing=spacing, origin=origin),
            LEVEL,
            mask=mask.T,
            clip=[isospline.HalfSpace(to_world(p), n / spacing) for n, p in planes],
            capped=True,
        )
        points = to_world(rng.uniform(-0.3, 1.3, (50, 3)) * cells)
        assert np.isinf(surface.closest_points(points).distances).all()


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_solids_without_thickness_have_no_caps(rng, degree):
    """The clip ends where the domain, or another half-space, begins."""
    volume = isospline.Volume(np.ones((7, 8, 9)), degree=degree)
    lower, upper = np.array(volume.bounds)
    points = rng.uniform(lower - 1, upper + 1, (50, 3))
    for axis in range(3):
        other = isospline.HalfSpace((lower + upper) / 2 + 0.2, unit((axis + 1) % 3) + 0.3 * unit(axis))
        at_domain = [isospline.HalfSpace(upper, unit(axis)), other]
        between = [isospline.HalfSpace(lower + 2, unit(axis)), isospline.HalfSpace(lower + 2, unit(axis, -1.0)), other]
        for clip in (at_domain, between):
            for closed in (False, True):
                flat = isospline.Isosurface(volume, LEVEL, clip=clip, capped=True, closed=closed)
                assert np.isinf(flat.closest_points(points).distances).all()
                assert float(flat.area()) == 0


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_areas_meshes_and_samples_of_caps_end_at_the_mask(rng, degree):
    """All planes are across axes, most of them on faces of cells: the area is a sum over cells."""
    for _ in range(30):
        cells = rng.integers(4, 9, 3)
        shape = cells if degree == 2 else cells + 1
        mask = random_mask(rng, shape)
        kept = kept_cells(mask, degree)
        axis, sign = rng.integers(3), rng.choice([-1.0, 1.0])
        place = float(rng.integers(1, cells[axis])) if rng.random() < 0.7 else rng.uniform(0, cells[axis])
        cell = int(np.floor(place) if sign > 0 else np.ceil(place) - 1)
        is_capped = np.moveaxis(kept, axis, 0)[cell]
        clip = isospline.HalfSpace((place + shift_of(degree)) * unit(axis), unit(axis, sign))
        surface = isospline.Isosurface(
            isospline.Volume(np.ones(shape[::-1]), degree=degree), LEVEL, mask=mask.T, clip=clip, capped=True
        )
        assert float(surface.area()) == pytest.approx(is_capped.sum(), abs=1e-6)
        if not is_capped.any():
            continue
        assert surface.to_mesh().to_trimesh().area == pytest.approx(is_capped.sum(), abs=1e-4)
        samples = surface.sample_points(200)["points"] - shift_of(degree)
        np.testing.assert_allclose(samples[:, axis], place, atol=1e-12)
        assert is_capped[tuple(np.floor(np.delete(samples, axis, axis=1)).astype(int).T)].all()


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_caps_of_the_largest_component_do_not_need_parts(rng, degree):
    """Cells of the other component, which has caps on the same planes, are not kept."""
    samples = np.full((8, 12, 16), -1.0)
    samples[:, 2:10, 2:8] = samples[:, 2:10, 12:] = 1.0
    volume = isospline.Volume(samples, degree=degree)
    clip = isospline.HalfSpace((0, 0, 4 + shift_of(degree)), (0, 0, -1))
    largest = isospline.Isosurface(volume, 0.0, largest=1, clip=clip, capped=True)
    points = rng.uniform(0, 1, (400, 3)) * [9, 12, 8]  # nearer to the larger one
    np.testing.assert_allclose(
        largest.closest_points(points).distances,
        isospline.Isosurface(volume, 0.0, clip=clip, capped=True).closest_points(points).distances,
        atol=2e-6,
    )
