"""Fixtures of the viewer's tests: a browser, files, a viewer of one of them, and its page."""

import numpy as np
import pytest

import isospline
from isospline import volumes


@pytest.fixture(scope="module")
def browser():
    from browser import chromium

    with chromium() as started:
        yield started


@pytest.fixture
def ball(tmp_path):
    """A small file, with the level 0 in the middle of its range."""
    path = tmp_path / "ball.npy"
    np.save(path, (1000 * volumes.sphere(0.7).values(20)).astype(np.int16))
    return path


@pytest.fixture(scope="session")
def large_ball(tmp_path_factory):
    """A ball of radius 20 about (32, 32, 32): 20 - r, above 0 inside."""
    z, y, x = np.mgrid[:65, :65, :65]
    path = tmp_path_factory.mktemp("volumes") / "ball.npy"
    np.save(path, (20 - np.sqrt((x - 32) ** 2 + (y - 32) ** 2 + (z - 32) ** 2)).astype(np.float32))
    return path


@pytest.fixture
def viewer(ball):
    with isospline.view(ball, browser=False) as opened:
        yield opened


@pytest.fixture
def page(browser, viewer):
    """The page of the viewer; a test that leaves an error in it fails."""
    from browser import Page

    opened = Page(browser, viewer.url)
    opened.settle()
    yield opened
    opened.close()
    assert not opened.problems
