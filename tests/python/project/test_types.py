"""Types, in `make lint`: pyright accepts examples and a user's script, as mypy does; stubs agree with the module."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = [pytest.mark.slow, pytest.mark.lint]


@pytest.fixture(scope="module")
def run(repository):
    """Runs a checker with the cache of `make lint`, and returns the lines of its output."""
    environment = {"MYPY_CACHE_DIR": str(repository / "build" / "mypy"), **os.environ}

    def run(*command, folder):
        result = subprocess.run(
            [sys.executable, "-m", *map(str, command)],
            cwd=folder,
            encoding="utf-8",
            capture_output=True,
            env=environment,
        )
        return (result.stdout + result.stderr).splitlines()

    return run


@pytest.fixture
def typed_sources(repository):
    return [
        *sorted((repository / "examples").glob("*.py")),
        repository / "tests" / "python" / "project" / "typed_user.py",
    ]


def test_pyright_accepts_examples_and_a_users_script(run, typed_sources, tmp_path):
    pytest.importorskip("basedpyright")
    settings = {
        "include": list(map(str, typed_sources)),
        "typeCheckingMode": "standard",
        "pythonVersion": "3.11",
        "venvPath": str(Path(sys.prefix).parent),
        "venv": Path(sys.prefix).name,
    }
    (tmp_path / "pyrightconfig.json").write_text(json.dumps(settings), encoding="utf-8")
    assert (
        run("basedpyright", "-p", tmp_path, "--level", "error", folder=tmp_path)[-1] == "0 errors, 0 warnings, 0 notes"
    )


def test_mypy_sees_mistakes(run, repository, tmp_path):
    """The checker finds errors, so that accepting the script means something."""
    pytest.importorskip("mypy")
    (tmp_path / "wrong.py").write_text(
        "import isospline\n"
        "isospline.Phong(colour=1)\n"
        "isospline.render(isospline.Scene(), size=128)\n"
        'isospline.render(isospline.Scene(), layers=("dept",))\n'
        "isospline.Scene().cast_rays([]).t_hits\n"
        'isospline.Volume([], boundary="mirrored")\n'
        "isospline.camera_for(isospline.Scene(), 200)\n",
        encoding="utf-8",
    )
    said = run("mypy", "--config-file", repository / "pyproject.toml", "wrong.py", folder=tmp_path)
    assert [int(line.split(":")[1]) for line in said if "error:" in line] == [2, 3, 4, 5, 6, 7]


def test_the_tool_writes_the_stub(repository, tmp_path):
    pytest.importorskip("pybind11_stubgen")
    written = tmp_path / "_core.pyi"
    subprocess.run([sys.executable, repository / "tools" / "write_stub.py", written], check=True)
    committed = repository / "python" / "isospline" / "_core.pyi"
    assert written.read_text(encoding="utf-8") == committed.read_text(encoding="utf-8"), "run make stubs"


@pytest.mark.long  # the stub is written from the module
def test_stub_says_what_the_module_has(run, repository, tmp_path):
    pytest.importorskip("mypy")
    settings = "--mypy-config-file", repository / "pyproject.toml"
    said = run("mypy.stubtest", "--concise", *settings, "isospline._core", folder=tmp_path)
    # Not in stubs: pybind11's metaclass, the methods for copies, and classes that only queries make.
    known = (
        r" is inconsistent, metaclass differs|\.__(deep)?copy__ is not present in stub|"
        r"(Shell|Image)\.__init__ is inconsistent, stub does not have \*args|(Volume|Mesh)\.from_"
    )
    assert any("metaclass differs" in line for line in said)
    assert not [line for line in said if line.startswith("isospline.") and not re.search(known, line)]
