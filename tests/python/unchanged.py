"""The option --leave-out-unchanged=FOLDER of pytest, which `make test` gives.

A change cannot make all tests fail: the results of a group of tests depend on few folders. Those of the viewer depend
on its code and that of pictures, those of a page on this page and the names that it uses. A group is left out if it
passed when these folders were as they are now. FOLDER remembers what has passed. `make ci-long` leaves out nothing.
"""

import hashlib
import os
import sys
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[2]
TESTS = "tests/python"
#: What all results depend on.
COMMON = ("pyproject.toml", "packages.txt", "tests/packages.txt", "tests/python/*.py")
#: The names of the library and of its command.
NAMES = ("python/isospline/__init__.py", "python/isospline/_core.pyi", "python/isospline/cli")
#: What most of the Python package is made of.
SHARED = ("python/isospline/*.py", "python/isospline/base")
#: The tests of pages, one for each page.
OF_PAGES = f"{TESTS}/project/test_pages.py::test_code_of_page_runs["


#: The folders of the core of which results of a kind are made, beside the one of this kind.
OF_MODELS = ("util", "math", "spline", "shell", "query")
OF_RAYS = (*OF_MODELS, "cell", "brick", "trace", "scene")


@dataclass(frozen=True)
class Group:
    """The beginnings of names of tests, and the files or folders that their results depend on besides."""

    name: str
    tests: tuple[str, ...]
    files: tuple[str, ...]


def of_the_core(name, folders, *files, tests=None):
    """A group of tests of compiled code."""
    core = [f"core/isospline/{each}" for each in folders]
    return Group(name, tests or (f"{name}/",), (*core, "bindings", *SHARED, *files))


GROUPS = (
    Group(
        "viewer",
        ("viewer/", "store/test_viewer_store.py", "interface/test_one_look.py"),
        (
            *SHARED,
            "python/isospline/viewer",
            "python/isospline/picture",
            "python/isospline/suggest",
            "tests/page",
            "tests/python/browser.py",
            "tests/python/viewer_client.py",
        ),
    ),
    Group(
        "readers",
        ("io/", "project/test_fuzz.py::test_changed_files_are_read_or_refused"),
        ("python/isospline/io", "core/isospline/io", "tests/fuzz"),
    ),
    Group(
        "stores",
        ("store/test_damaged", "store/test_store.py", "store/test_store_pyramid.py", "store/test_store_reliability.py"),
        ("python/isospline/store", "core/isospline/store", "core/isospline/spline", "bindings/bind_store.cpp"),
    ),
    Group(
        "clusters",
        ("cluster/", "cli/test_cli_cluster.py"),
        ("python/isospline/distributed", "python/isospline/store", "python/isospline/cli", "bindings/bind_state.cpp"),
    ),
    Group("examples", ("project/test_examples.py",), ("examples", *NAMES)),
    Group("site", ("project/test_site.py",), ("README.md", "CONTRIBUTING.md", "docs", *NAMES)),
    of_the_core("shell", (*OF_MODELS, "measure")),
    of_the_core("query", OF_RAYS, "python/isospline/certificates", "python/isospline/farthest"),
    of_the_core("scene", (*OF_RAYS, "hopper")),
    of_the_core("measure", (*OF_MODELS, "measure")),
    of_the_core("polygonize", (*OF_MODELS, "polygonize"), "python/isospline/interop"),
    of_the_core("labels", (*OF_MODELS, "measure", "polygonize"), "python/isospline/labels"),
    of_the_core("derivatives", (*OF_RAYS, "measure"), "python/isospline/derivatives"),
    of_the_core("pictures", (*OF_RAYS, "shade", "render"), "python/isospline/picture", tests=("render/", "shade/")),
)


def group_of(item):
    """The group of a test, or None."""
    if item.nodeid.startswith(OF_PAGES):
        page = str(item.callspec.params["page"].relative_to(REPOSITORY))
        return Group(page, ("project/test_pages.py",), (page, "docs/pages.py", *NAMES))
    for group in GROUPS:
        if any(item.nodeid.startswith(f"{TESTS}/{each}") for each in group.tests):
            return group
    return None


def patterns_of(group):
    """Patterns of the paths of all files and folders on which the results of a group depend."""
    tests = [f"{TESTS}/{each.partition('::')[0]}*" for each in group.tests]
    return [*COMMON, *group.files, *tests]


def key_of(group):
    """A text that differs if a file differs on which the results of a group depend."""
    digest = hashlib.sha256(f"{group.name} {sys.version} {os.environ.get('ISOSPLINE_VOLUMES')}".encode())
    for path in sorted({path for pattern in patterns_of(group) for path in REPOSITORY.glob(pattern)}):
        for file in sorted(path.rglob("*")) if path.is_dir() else [path]:
            if file.is_file() and file.suffix not in (".pyc", ".so"):
                digest.update(f"{file.relative_to(REPOSITORY)}\0".encode())
                digest.update(hashlib.sha256(file.read_bytes()).digest())
    return digest.hexdigest()


def pytest_addoption(parser):
    parser.addoption(
        "--leave-out-unchanged",
        metavar="FOLDER",
        help="leave out groups of tests that passed for the same files, and remember in FOLDER which have passed",
    )


class LeavingOut:
    """Leaves out groups that have passed, and remembers at the end which have passed in this run."""

    def __init__(self, config, folder):
        self.config = config
        self.folder = folder
        self.outcomes = {}  #: by the keys of groups
        self.left_out = Counter()  #: numbers of tests by the names of groups

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, items):
        keys, left_out = {}, []
        for item in list(items):
            if (group := group_of(item)) is None:
                continue
            if group not in keys:
                keys[group] = key_of(group)
            if (self.folder / keys[group]).exists():
                items.remove(item)
                left_out.append(item)
                self.left_out[group.name] += 1
            else:
                item.user_properties.append(("group", keys[group]))
        self.config.hook.pytest_deselected(items=left_out)

    def pytest_runtest_logreport(self, report):
        for name, key in report.user_properties:
            if name == "group":
                self.outcomes.setdefault(key, Counter())[report.outcome] += 1

    def pytest_sessionfinish(self, exitstatus):
        if hasattr(self.config, "workeroutput"):  # one of the processes of pytest-xdist, which collect and run
            self.config.workeroutput["left_out"] = dict(self.left_out)
        elif exitstatus in (pytest.ExitCode.OK, pytest.ExitCode.TESTS_FAILED):  # otherwise not all tests have run
            self.folder.mkdir(parents=True, exist_ok=True)
            for key, outcomes in self.outcomes.items():
                if outcomes["passed"] and not outcomes["failed"]:
                    (self.folder / key).touch()

    @pytest.hookimpl(optionalhook=True)
    def pytest_testnodedown(self, node):
        self.left_out = Counter(getattr(node, "workeroutput", {}).get("left_out", self.left_out))

    def pytest_terminal_summary(self, terminalreporter):
        if self.left_out:
            names = ", ".join(f"{name} ({count})" for name, count in self.left_out.items())
            terminalreporter.write_line(f"left out, because they passed for the same files: {names}")


def pytest_configure(config):
    if folder := config.getoption("leave_out_unchanged"):
        config.pluginmanager.register(LeavingOut(config, Path(folder)))
