"""Grounds below scenes."""

import numpy as np
import pytest

import isospline

FIELD = isospline.volumes.sphere(0.5)
VOLUME = FIELD.volume(33)


def make_scene():
    return isospline.Scene([isospline.Isosurface(VOLUME, FIELD.level)])


@pytest.mark.parametrize("up", [(0, 0, 1), (0, 0, -2), (0, 1, 0), (-3, 0, 0), (1, 2, -3)])
def test_a_ball_stands_on_its_ground(up):
    """The ground touches the ball to within the size of a cell, for every upward direction."""
    ground = isospline.ground_for(make_scene(), up=up, reach=3)
    unit, cell = np.array(up) / np.linalg.norm(up), 2 / 32
    heights = ground.vertices @ unit
    np.testing.assert_allclose(heights, heights[0], atol=1e-9)
    assert -0.5 - 2 * cell < heights[0] <= -0.5 + 1e-6
    edges = np.linalg.norm(np.diff(ground.vertices, axis=0), axis=1)
    np.testing.assert_allclose(edges, 2 * 3 * np.sqrt(3), rtol=0.3)
    middle = ground.vertices.mean(axis=0)
    np.testing.assert_allclose(middle - (middle @ unit) * unit, 0, atol=cell)
    normal = np.cross(ground.vertices[1] - ground.vertices[0], ground.vertices[2] - ground.vertices[1])
    np.testing.assert_allclose(normal / np.linalg.norm(normal), unit, atol=1e-12)  # its outer side is above


@pytest.mark.parametrize(
    "options, message",
    [
        ({"up": (0, 0, 0)}, "up: expected three finite numbers"),
        ({"up": (0, 0, np.nan)}, "up: expected three finite numbers"),
        ({"up": 1}, "up: expected three finite numbers"),
        ({"reach": 0}, "reach: expected a finite number above 0"),
        ({"scene": isospline.Scene([])}, "scene: expected one with an extent"),
    ],
    ids=str,
)
def test_grounds_that_make_no_sense(options, message):
    with pytest.raises(ValueError, match=f"^{message}"):
        isospline.ground_for(**{"scene": make_scene(), **options})


def test_a_reach_that_is_no_number():
    with pytest.raises(TypeError, match="^reach: expected a number, got 'far'$"):
        isospline.ground_for(make_scene(), reach="far")
