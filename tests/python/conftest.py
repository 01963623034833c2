"""Fixtures of the Python tests, and a summary of their times."""

import collections
import os
from pathlib import Path

import numpy as np
import pytest
from interrupts import obey_interrupts


def pytest_configure():
    """Tests send SIGINT to their own process, which background jobs ignore."""
    obey_interrupts()


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
    """The folder of real volumes given by ISOSPLINE_VOLUMES; the test is skipped if it is not set."""
    folder = os.environ.get("ISOSPLINE_VOLUMES")
    if not folder:
        pytest.skip("ISOSPLINE_VOLUMES is not set")
    return Path(folder)


def pytest_terminal_summary(terminalreporter):
    """The time of each folder, and the slowest files."""
    folders, files = collections.Counter(), collections.Counter()
    for report in (each for reports in terminalreporter.stats.values() for each in reports):
        if hasattr(report, "duration"):
            path = Path(report.nodeid.partition("::")[0])
            folders[str(path.parent)] += report.duration
            files[str(path)] += report.duration
    if sum(folders.values()) < 10:
        return
    terminalreporter.section("time by folder, and the slowest files")
    for name, seconds in [*folders.most_common(), *files.most_common(10)]:
        terminalreporter.write_line(f"{seconds:8.1f} s  {name}")
