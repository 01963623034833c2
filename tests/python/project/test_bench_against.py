"""make bench-against: two revisions get the same rays in turns, and different answers end the run."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import isospline

pytestmark = pytest.mark.slow

ROWS = {
    "packets": "Mray/s",
    "single": "Mray/s",
    "default": "Mray/s",
    "bounce": "Mray/s",
    "ambient": "Mray/s",
    "shadow": "Mray/s",
    "render": "ms",
    "render_shadows": "ms",
    "level": "ms",
    "level_picture": "ms",
    "memory": "MB",
    "prefilter": "ms",
}


@pytest.fixture
def built_tree(tmp_path):
    """A tree that holds a copy of the package; its compiled module is that of the package."""
    package = tmp_path / "tree" / "python" / "isospline"
    shutil.copytree(isospline.__path__[0], package, symlinks=True, ignore=shutil.ignore_patterns("__pycache__"))
    return tmp_path / "tree"


def run(repository, *arguments):
    command = [sys.executable, repository / "bench" / "against.py", *arguments]
    environment = {name: value for name, value in os.environ.items() if name != "ISOSPLINE_VOLUMES"}
    paths = [str(Path(isospline.__path__[0]).parent), *filter(None, [environment.get("PYTHONPATH")])]
    environment["PYTHONPATH"] = os.pathsep.join(paths)
    return subprocess.run(command, capture_output=True, encoding="utf-8", check=False, env=environment)


@pytest.mark.long
def test_a_small_run_has_all_rows_and_equal_answers(repository, built_tree, tmp_path):
    options = ["--quick", "--volumes", "gyroid", "--size", "16", "--repetitions", "1", "--output", tmp_path]
    done = run(repository, built_tree, *options)
    assert done.returncode == 0, done.stdout + done.stderr
    results = json.loads((tmp_path / "against.json").read_text(encoding="utf-8"))["results"]
    found = [result for result in results if "," not in result["row"]]
    assert {result["row"]: result["unit"] for result in found} == ROWS
    assert all(result["different"] == 0 for result in results)
    for result in found:
        new, old = (result[way]["median"] for way in ("new", "old"))
        expected = new / old if result["unit"] == "Mray/s" else old / new
        assert result["ratio"]["median"] == pytest.approx(expected)
        if ROWS[result["row"]] == "Mray/s":
            assert 0 < new < 1000
    text = (tmp_path / "against.md").read_text(encoding="utf-8")
    assert all(f"| {row} | gyroid 64 |" in text for row in ROWS)


@pytest.mark.long
def test_different_answers_end_the_run(repository, built_tree, tmp_path):
    path = built_tree / "python" / "isospline" / "__init__.py"
    changed = """
_cast = Scene.cast_rays
Scene.cast_rays = lambda self, rays, **options: {"t_hit": 2 * _cast(self, rays, **options)["t_hit"]}
"""
    path.write_text(path.read_text(encoding="utf-8") + changed, encoding="utf-8")
    options = ["packets", "--quick", "--volumes", "gyroid", "--size", "16", "--repetitions", "1", "--output", tmp_path]
    done = run(repository, built_tree, *options)
    assert done.returncode == 1
    assert "more than 0.001 of the answers differ in: packets" in done.stderr


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["no-such-commit"], "REV: expected a commit or the folder of a built tree"),
        (["."], "REV: expected a commit or the folder of a built tree, got .: no "),
        (["HEAD", "rays"], "ROW: expected some of packets, single"),
        (["HEAD", "--size", "6"], "--size: expected a multiple of 4, got 6"),
    ],
)
def test_wrong_arguments_give_one_message(repository, tmp_path, monkeypatch, arguments, message):
    monkeypatch.chdir(tmp_path)
    done = run(repository, *arguments)
    assert done.returncode != 0
    assert message in done.stderr
    assert "Traceback" not in done.stderr
