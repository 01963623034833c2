"""The thickness of an open plate near the border of its volume, in any direction."""

import numpy as np
import pytest

import isospline


@pytest.mark.parametrize("cut", [False, True], ids=["border", "clip"])
def test_a_plate_is_as_thick_at_its_open_border(cut):
    data = 4 - np.abs(np.indices((20, 20, 20))[0] - 9.5)
    random = np.random.default_rng(0)
    for _ in range(3):
        axes = np.linalg.qr(random.normal(size=(3, 3)))[0]
        volume = isospline.Volume(data, spacing=(1, 2, 0.5), direction=axes, degree=1)
        clip = [isospline.HalfSpace(axes @ (9.3, 0, 0), axes[:, 0])] if cut else ()
        plate = isospline.Isosurface(volume, 0.0, clip=clip)
        thickness = plate.thickness(plate.sample_points(1000)["points"])
        np.testing.assert_allclose(thickness, 4, atol=0.02)
