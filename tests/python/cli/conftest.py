"""Files for the tests of the command line."""

import numpy as np
import pytest

from isospline import volumes


@pytest.fixture
def ball(tmp_path):
    """A ball of radius 0.7 in [-1, 1]^3, in whole samples: 700 r^2 below 490 inside."""
    path = tmp_path / "ball.npy"
    np.save(path, (1000 * volumes.sphere(0.7).samples((20, 22, 24))).astype(np.int16))
    return path


@pytest.fixture
def plate(tmp_path):
    """A square below the ball, as a file."""
    pytest.importorskip("trimesh")
    text = "OFF\n4 2 0\n0 0 1\n23 0 1\n23 21 1\n0 21 1\n3 0 1 2\n3 0 2 3\n"
    (tmp_path / "plate.off").write_text(text, encoding="utf-8")
    return tmp_path / "plate.off"


@pytest.fixture
def picture(tmp_path):
    return tmp_path / "picture.png"
