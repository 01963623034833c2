"""Primitive ids of isosurfaces: places of cells in the volume."""

import numpy as np
import pytest

import isospline


@pytest.mark.parametrize("axes", ["zyx", "xyz"])
@pytest.mark.parametrize("degree", [1, 2, 3])
def test_ids_are_places_in_the_grid_of_cells(degree, axes):
    volume = isospline.Volume(np.zeros((5, 6, 7)), degree=degree, axes=axes)
    shape = np.array((5, 6, 7) if axes == "xyz" else (7, 6, 5)) - degree % 2
    assert volume.cell_count == shape.prod()
    ids = np.arange(volume.cell_count)
    cells = volume.cell_at(ids)
    assert cells.dtype == np.int32
    np.testing.assert_array_equal(cells, np.stack(np.unravel_index(ids, shape[::-1])[::-1], axis=-1))
    back = volume.primitive_id(cells)
    assert back.dtype == np.uint64
    np.testing.assert_array_equal(back, ids)
    assert volume.cell_at(ids.reshape(-1, 2)).shape == (len(ids) // 2, 2, 3)
    assert volume.primitive_id(cells[0]).shape == () and volume.cell_at(3).tolist() == [3, 0, 0]


def test_ids_are_the_same_for_every_level_and_surface():
    """A plane moves along x: each ray hits the cell of its own row and slice."""
    volume = isospline.Volume(np.broadcast_to(np.arange(20.0), (8, 9, 20)))
    y, z = np.meshgrid(np.arange(9), np.arange(8))
    rays = np.stack([np.full(y.shape, -5.0), y, z, *np.eye(3)[0][:, None, None] + np.zeros(y.shape)], axis=-1)
    surface = isospline.Isosurface(volume, 4.1)
    scene = isospline.Scene([surface])
    for level in (4.1, 11.9, 7.3):
        surface.level = level
        for coherent in (False, True):
            ids = scene.cast_rays(rays, coherent=coherent)["primitive_ids"]
            np.testing.assert_array_equal(ids, round(level) + 20 * (y + 9 * z))
        upper = isospline.Isosurface(volume, level, clip=isospline.HalfSpace((0, 4.5, 0), (0, 1, 0)))
        ids = isospline.Scene([upper]).cast_rays(rays)["primitive_ids"]
        np.testing.assert_array_equal(ids[y > 4], (round(level) + 20 * (y + 9 * z))[y > 4])
        assert (ids[y < 5] == isospline.INVALID_PRIMITIVE_ID).all()


@pytest.mark.parametrize(
    ("method", "value", "error", "message"),
    [
        ("cell_at", [3, 210], ValueError, "primitive_ids: expected ids of cells, below 210, got 210"),
        ("cell_at", 2**32, ValueError, "primitive_ids: .* got 4294967296"),
        ("cell_at", isospline.INVALID_PRIMITIVE_ID, ValueError, "primitive_ids: .* got 18446744073709551615"),
        ("cell_at", -1, ValueError, "primitive_ids: .* got"),
        ("cell_at", 1.0, TypeError, "primitive_ids: expected an array of integers"),
        ("primitive_id", (7, 0, 0), ValueError, r"cells: expected x, y, z below \(7, 6, 5\), got \(7, 0, 0\)"),
        ("primitive_id", (0, -1, 0), ValueError, r"cells: .* got \(0, -1, 0\)"),
        ("primitive_id", (2**32, 0, 0), ValueError, r"cells: .* got \(4294967296, 0, 0\)"),
        ("primitive_id", (0, 0), ValueError, r"cells: expected shape \(..., 3\), got \(2,\)"),
        ("primitive_id", 5, ValueError, r"cells: expected shape \(..., 3\), got \(\)"),
        ("primitive_id", "text", TypeError, "cells: expected an array of integers"),
    ],
)
def test_what_is_no_cell_is_an_error(method, value, error, message):
    volume = isospline.Volume(np.zeros((5, 6, 7)))
    with pytest.raises(error, match=message):
        getattr(volume, method)(value)
