"""Fixtures of the Python tests, and a summary of their times."""

import collections
import os
import random
from pathlib import Path

import numpy as np
import pytest
from interrupts import obey_interrupts

import isospline
from isospline import volumes

pytest_plugins = ("unchanged",)
collect_ignore = ["project/added_shading"]  # a module of a package that a test makes

# Files that take longest. They run first, so that no process has one left when the others have finished.
LONGEST = (
    "test_pages",
    "test_viewer_page",
    "test_site",
    "test_fuzz",
    "test_store_reliability",
    "test_threads",
    "test_components",
    "test_measure",
    "test_path_tracer",
    "test_distributed",
)


def pytest_collection_modifyitems(items):
    """Move the longest files to the front; tests in a browser are slow ones; most cases of a sweep are long ones."""
    sweeps = collections.defaultdict(list)
    for item in items:
        if "browser" in item.fixturenames:
            item.add_marker(pytest.mark.slow)
        if (mark := item.get_closest_marker("sweep")) and not item.get_closest_marker("long"):
            sweeps[item.path, item.originalname, mark.args[0]].append(item)
    for (_, name, count), cases in sweeps.items():
        kept = random.Random(name).sample(range(len(cases)), min(count, len(cases)))
        for number, item in enumerate(cases):
            if number not in kept:
                item.add_marker(pytest.mark.long)
    place = {name: number for number, name in enumerate(LONGEST)}
    items.sort(key=lambda item: place.get(item.path.stem, len(LONGEST)))


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


@pytest.fixture
def scan_with_table(tmp_path):
    """A NIfTI file of a CT of a patient on a table, and the number of cells of the bone's surface at level 300.

    The bone is a cylinder of radius 4 about (24, 16); the table, which is larger and denser, is at y = 36 to 39. The
    samples are also in a file .npy beside it.
    """
    nibabel = pytest.importorskip("nibabel")
    _, y, x = np.mgrid[0:40, 0:44, 0:48]
    data = np.where(np.hypot(x - 24, y - 16) < 12, 40, -1000).astype(np.int16)
    data[np.hypot(x - 24, y - 16) < 4] = 700
    bone = isospline.Isosurface(isospline.Volume(data), 300).shell.count
    data[:, 36:40] = 1200
    nibabel.save(nibabel.Nifti1Image(data.T, np.diag([-1, -1, 1, 1])), tmp_path / "scan.nii")
    np.save(tmp_path / "scan.npy", data)
    return tmp_path / "scan.nii", bone


@pytest.fixture
def ball(tmp_path):
    """For the command line: a ball of radius 0.7 in [-1, 1]^3, in whole samples: 700 r^2 below 490 inside."""
    path = tmp_path / "ball.npy"
    np.save(path, (1000 * volumes.sphere(0.7).values((20, 22, 24))).astype(np.int16))
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
