"""The option --leave-out-unchanged=FOLDER of pytest, which `make test` gives.

Most changes can affect only some of the tests: the results of a group of tests depend on some folders. Those of the
viewer depend on its code and that of pictures, those of a page on this page and the Python package. A group is left out
if all its tests passed when these folders were as they are now. FOLDER remembers that. `make test-long` leaves out
nothing.
"""

import functools
import hashlib
import os
import sys
from collections import Counter
from dataclasses import dataclass
from importlib.metadata import distributions
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[2]
TESTS = "tests/python"
PACKAGE = "python/isospline"
#: What all results depend on.
COMMON = ("pyproject.toml", "packages.txt", "tests/packages.txt", f"{TESTS}/*.py")
#: What most of the Python package is made of.
SHARED = (f"{PACKAGE}/*.py", f"{PACKAGE}/_core.pyi", f"{PACKAGE}/base")
#: What compiled code is made from, beside the folders of the core.
COMPILED = ("CMakeLists.txt", "CMakePresets.json", "cmake", "bindings")
#: The folders of the core on which all others are built.
MODELS = ("util", "math", "spline", "shell", "cell", "brick", "trace", "scene", "query", "measure")
#: The tests of pages, a group for each page.
OF_PAGES = f"{TESTS}/project/test_pages.py::test_code_of_page_runs["


@dataclass(frozen=True)
class Group:
    """The beginnings of names of tests, and the files or folders that their results depend on besides."""

    name: str
    tests: tuple[str, ...]
    files: tuple[str, ...]


def of_package(name, tests, folders, others):
    """A group of tests of some folders of the Python package."""
    return Group(name, tests, (*SHARED, *(f"{PACKAGE}/{each}" for each in folders), *others))


def of_core(name, *folders, others=(), tests=None):
    """A group of tests of compiled code: of MODELS and further folders of the core."""
    core = [f"core/isospline/{each}" for each in (*MODELS, *folders)]
    return Group(name, tests or (f"{name}/",), (*core, *COMPILED, *SHARED, *others))


def of_page(page):
    """The group of a page's code; the page's path is its name."""
    return Group(page, ("project/test_pages.py",), (page, "docs/page*.py", PACKAGE))


GROUPS = (
    of_package(
        "viewer",
        ("viewer/", "store/test_viewer_store.py", "interface/test_one_look.py"),
        ("viewer", "picture", "suggest", "store", "io"),
        others=("tests/page",),
    ),
    of_package(
        "readers",
        ("io/", "project/test_fuzz.py::test_changed_files_are_read_or_refused"),
        ("io",),
        others=("core/isospline/io", "core/isospline/util", "tests/fuzz"),
    ),
    of_package(
        "stores",
        ("store/test_damaged", "store/test_store.py", "store/test_store_pyramid.py", "store/test_store_reliability.py"),
        ("store", "io"),
        others=(*COMPILED, *(f"core/isospline/{each}" for each in ("store", "spline", "math", "util"))),
    ),
    Group("clusters", ("cluster/", "cli/test_cli_cluster.py"), (PACKAGE, "bindings")),
    Group("examples", ("project/test_examples.py",), ("examples", PACKAGE)),
    Group("site", ("project/test_site.py",), ("README.md", "CONTRIBUTING.md", "docs", PACKAGE)),
    of_core("shell"),
    of_core("query", others=(f"{PACKAGE}/certificates", f"{PACKAGE}/farthest")),
    of_core("scene", "hopper"),
    of_core("measure"),
    of_core("polygonize", "polygonize", others=(f"{PACKAGE}/interop",)),
    of_core("labels", "polygonize", others=(f"{PACKAGE}/labels",)),
    of_core("derivatives", others=(f"{PACKAGE}/derivatives",)),
    of_core("pictures", "shade", "render", others=(PACKAGE,), tests=("render/", "shade/")),
)


def group_of(nodeid):
    """The name of the group of a test, or None."""
    if nodeid.startswith(OF_PAGES):
        return nodeid.removeprefix(OF_PAGES).removesuffix("]")
    for group in GROUPS:
        if any(nodeid.startswith(f"{TESTS}/{each}") for each in group.tests):
            return group.name
    return None


def patterns_of(name):
    """Patterns of the paths of all files and folders on which the results of a group depend."""
    group = next((each for each in GROUPS if each.name == name), None) or of_page(name)
    tests = [f"{TESTS}/{each.partition('::')[0]}*" for each in group.tests]
    return [*COMMON, *group.files, *tests]


@functools.cache
def surroundings():
    """What results depend on beside files: Python, its packages, and the variables that tests read."""
    # A process of pytest-xdist has folders of packages twice in its path.
    packages = sorted({f"{each.name} {each.version}" for each in distributions() if each.name != "isospline"})
    variables = sorted(f"{name}={value}" for name, value in os.environ.items() if name.startswith("ISOSPLINE_"))
    return "\n".join([sys.version, *packages, *variables])


def key_of(name, nodeids):
    """A text that differs if something differs on which the results of these tests of a group depend."""
    digest = hashlib.sha256("\n".join([name, *sorted(nodeids), surroundings()]).encode())
    for path in sorted({path for pattern in patterns_of(name) for path in REPOSITORY.glob(pattern)}):
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
    """Leaves out groups that have passed, and remembers at the end which have passed in this run.

    The processes of pytest-xdist collect and run the tests, and tell the first process which tests a group has.
    """

    def __init__(self, config, folder):
        self.config = config
        self.folder = folder
        known = [path.name for path in folder.iterdir()] if folder.exists() else []
        self.known = getattr(config, "workerinput", {}).get("known_groups", known)
        self.keys = {}  #: by the names of groups
        self.tests = {}  #: names of tests, by the names of groups
        self.left_out = {}  #: numbers of tests, by the names of groups
        self.good, self.bad = set(), set()  #: names of tests
        self.is_whole = True  #: whether all files of tests were read

    @pytest.hookimpl(optionalhook=True)
    def pytest_configure_node(self, node):
        node.workerinput["known_groups"] = self.known

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, items):
        found = {}
        for item in items:
            if (name := group_of(item.nodeid)) is not None:
                found.setdefault(name, []).append(item)
        for name, members in found.items():
            tests = [item.nodeid for item in members]
            key = key_of(name, tests)
            if key in self.known:
                self.left_out[name] = len(members)
                self.config.hook.pytest_deselected(items=members)
            else:
                self.keys[name], self.tests[name] = key, tests
        items[:] = [item for item in items if group_of(item.nodeid) not in self.left_out]

    def pytest_collectreport(self, report):
        self.is_whole &= not report.failed

    def pytest_runtest_logreport(self, report):
        if report.failed:
            self.bad.add(report.nodeid)
        elif report.when == "call" or report.skipped:
            self.good.add(report.nodeid)

    @pytest.hookimpl(optionalhook=True)
    def pytest_testnodedown(self, node):
        output = getattr(node, "workeroutput", {})  # none of a process that has crashed
        self.keys.update(output.get("keys", {}))
        self.tests.update(output.get("tests", {}))
        self.left_out.update(output.get("left_out", {}))

    def pytest_sessionfinish(self, exitstatus):
        if hasattr(self.config, "workeroutput"):
            self.config.workeroutput.update(keys=self.keys, tests=self.tests, left_out=self.left_out)
        elif self.is_whole and exitstatus in (pytest.ExitCode.OK, pytest.ExitCode.TESTS_FAILED):
            self.folder.mkdir(parents=True, exist_ok=True)
            for name, tests in self.tests.items():
                # Not if a file has changed meanwhile.
                if self.good - self.bad >= set(tests) and key_of(name, tests) == self.keys[name]:
                    (self.folder / self.keys[name]).touch()

    def pytest_terminal_summary(self, terminalreporter):
        if self.left_out:
            counts = Counter()
            for name, count in self.left_out.items():
                counts["pages" if name.endswith(".md") else name] += count
            names = ", ".join(f"{name} ({count})" for name, count in counts.items())
            terminalreporter.write_line(f"left out, because they passed for the same files: {names}")


def pytest_configure(config):
    if folder := config.getoption("leave_out_unchanged"):
        config.pluginmanager.register(LeavingOut(config, Path(folder)))
