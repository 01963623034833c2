"""Fixtures of the Python tests."""

import os
from pathlib import Path

import numpy as np
import pytest


@pytest.fixture
def rng():
    """A random generator with the same numbers in every run."""
    return np.random.default_rng(20250101)


@pytest.fixture(scope="session")
def repository():
    """The root of the source checkout."""
    return Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def volumes_folder():
    """The folder of real volumes that ISOSPLINE_VOLUMES names; the test is skipped where it is not set."""
    folder = os.environ.get("ISOSPLINE_VOLUMES")
    if not folder:
        pytest.skip("ISOSPLINE_VOLUMES is not set")
    return Path(folder)
