"""The contents of sdists and wheels."""

import hashlib
import re
import subprocess
import tarfile
import zipfile

import pytest

import isospline

pytestmark = pytest.mark.slow


def symbols(path):
    """The names that a library exports."""
    listed = subprocess.run(
        ["nm", "-D", "--extern-only", "--defined-only", path], capture_output=True, encoding="utf-8", check=True
    ).stdout
    return [line.split()[-1] for line in listed.splitlines()]


def test_the_module_shows_others_nothing_of_what_is_linked_into_it():
    assert symbols(isospline._core.__file__) == ["PyInit__core"]


def test_what_other_platforms_leave_out_is_there(repository):
    script = repository / "tests" / "python" / "of_the_module"
    options = subprocess.run([script], capture_output=True, encoding="utf-8", check=True).stdout.split()
    assert len(options) > 5
    assert all((repository / option.removeprefix("--ignore=")).exists() for option in options)


def commands(repository, target):
    """What `make` would run to make a target from nothing."""
    made = ["make", "--dry-run", "--always-make", target]
    return subprocess.run(made, cwd=repository, capture_output=True, encoding="utf-8", check=True).stdout


def test_the_demo_installs_and_builds_nothing_of_the_tests(repository):
    demo, test = (commands(repository, target) for target in (".venv/.demo", ".venv/.installed"))
    for part in ("tests/packages.txt", "ISOSPLINE_BUILD_TESTS=ON", "ISOSPLINE_BUILD_BENCH=ON", " test docs "):
        assert part not in demo and part in test
    assert "ISOSPLINE_BUILD_TESTS=OFF" in demo
    listed = (repository / "packages.txt").read_text(encoding="utf-8")
    for name in ("chromium", "catch2", "libbenchmark-dev"):
        assert name not in listed and name in (repository / "tests" / "packages.txt").read_text(encoding="utf-8")


def test_development_links_python_files_and_tests_do_not(repository):
    assert "--editable" in commands(repository, ".venv/.linked")
    assert "--editable" not in commands(repository, ".venv/.installed")


def build_sdist(repository, folder):
    """The packed sources of the last commit."""
    pytest.importorskip("scikit_build_core")
    command = [repository / "tools" / "build_sdist", folder]
    subprocess.run(command, check=True, capture_output=True, timeout=300)
    (path,) = folder.iterdir()
    return path


def test_packed_sources_are_whole_and_the_same_bytes_each_time(repository, tmp_path):
    sdist, again = (build_sdist(repository, tmp_path / name) for name in ("once", "twice"))
    assert again.name == sdist.name == f"isospline-{isospline.__version__}.tar.gz"
    assert hashlib.sha256(again.read_bytes()).digest() == hashlib.sha256(sdist.read_bytes()).digest()
    with tarfile.open(sdist) as archive:
        packed = {name.partition("/")[2] for name in archive.getnames()}
    command = ["git", "-C", repository, "ls-tree", "-r", "--name-only", "HEAD"]
    names = subprocess.run(command, capture_output=True, encoding="utf-8", check=True).stdout.split()
    needed = [name for name in names if not name.startswith((".", "docs/"))]
    assert len(needed) > 400 and not set(needed) - packed


def wheels(repository):
    found = sorted((repository / "dist").glob(f"isospline-{isospline.__version__}-*.whl"))
    if not found:
        pytest.skip("dist/ has no wheels: make wheel")
    return found


def test_wheels_hold_their_libraries_and_the_licences_of_these(repository, tmp_path):
    notices = (repository / "licenses" / "third-party.txt").read_text(encoding="utf-8")
    for path in wheels(repository):
        assert re.search(r"-manylinux_2_\d+_(x86_64|aarch64)\.whl$", path.name)
        with zipfile.ZipFile(path) as wheel:
            names = wheel.namelist()
            wheel.extractall(tmp_path / path.stem)
        libraries = [name.partition("/")[2] for name in names if re.match("isospline.libs/.", name)]
        kinds = {re.match(r"lib[A-Za-z]+", name).group() for name in libraries}
        assert {"libembree", "libtbb", "libOpenEXR", "libhwy"} <= kinds
        assert all(kind in notices for kind in kinds), kinds
        # A hash in each name: no other package's library is taken for it.
        assert all(re.search(r"-[0-9a-f]{8}\.", name) for name in libraries), libraries
        info = f"isospline-{isospline.__version__}.dist-info/licenses"
        assert {f"{info}/LICENSE", f"{info}/licenses/third-party.txt"} <= set(names)
        (module,) = (name for name in names if re.fullmatch(r"isospline/_core\..*\.so", name))
        assert symbols(tmp_path / path.stem / module) == ["PyInit__core"]
        assert path.stat().st_size < 25e6
