"""Which components are the largest, by the volumes of balls."""

import numpy as np
import pytest

import isospline


@pytest.mark.sweep(3)
@pytest.mark.parametrize("degree", [1, 2, 3])
@pytest.mark.parametrize("inside", ["above", "below"])
def test_balls_of_nearly_the_same_size_are_ranked_by_their_volumes(degree, inside):
    """The largest two differ by 0.3 % in volume. The last two are equal at degree 1, whose model is local."""
    centers = [(12, 12, 12), (36, 12, 12), (12, 36, 12), (36, 36, 12), (12, 12, 36), (12, 12, 60)]
    radii = [8.0, 8.06, 8.13, 8.122, 7.9, 7.9]
    z, y, x = np.mgrid[0:72, 0:48, 0:48].astype(float)
    distance = [r - np.sqrt((x - c[0]) ** 2 + (y - c[1]) ** 2 + (z - c[2]) ** 2) for c, r in zip(centers, radii)]
    samples = np.max(distance, axis=0)
    volume = isospline.Volume(samples if inside == "above" else -samples, degree=degree)
    expected = [2, 3, 1, 0, 4, 5]  # of two with the same volume, the one whose bricks come first
    for count in range(1, 6 if degree == 1 else 5):
        for threads in (1, 0):
            isospline.set_thread_count(threads)
            kept = isospline.Isosurface(volume, 0.0, largest=count, inside=inside).contains(centers)
            assert set(np.flatnonzero(kept)) == set(expected[:count])
