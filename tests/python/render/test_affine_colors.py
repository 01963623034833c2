"""`ColorByVolume` with transforms whose inverse is rounded."""

import numpy as np

import isospline


def test_every_invertible_affine_transform_is_accepted():
    volume = isospline.Volume(np.random.default_rng(0).random((5, 5, 5)))
    random = np.random.default_rng(1)
    isospline.ColorByVolume(volume, transform=np.diag([0.001, 0.001, 0.001, 1]))
    for _ in range(200):
        matrix = np.eye(4)
        matrix[:3] = random.normal(size=(3, 4)) * np.exp(3 * random.normal())
        np.testing.assert_array_equal(isospline.ColorByVolume(volume, transform=matrix).transform, matrix)
