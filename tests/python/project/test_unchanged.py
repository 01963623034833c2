"""`make test` leaves out groups of tests that have passed for the same files."""

import os
import re
import subprocess
import sys
from types import SimpleNamespace

import pytest
import unchanged
from unchanged import GROUPS, REPOSITORY, TESTS, LeavingOut, key_of, of_page, patterns_of

NAMES = [group.name for group in GROUPS]


def last_lines(folder, file):
    command = [sys.executable, "-m", "pytest", "-q", "-p", "xdist", "--numprocesses", "1", "-p", "no:cacheprovider"]
    command += [f"--leave-out-unchanged={folder}", f"{TESTS}/{file}"]
    environment = {**os.environ, "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}  # others take a second each time
    ended = subprocess.run(command, cwd=REPOSITORY, capture_output=True, encoding="utf-8", env=environment)
    return ended.stdout.strip().splitlines()[-2:]


@pytest.mark.slow
def test_what_has_passed_is_left_out(tmp_path):
    assert re.fullmatch(r"\d+ passed in .*", last_lines(tmp_path, "shell/test_levels.py")[1])
    left_out, passed = last_lines(tmp_path, "shell/test_levels.py")
    assert re.fullmatch(r"left out, because they passed for the same files: shell \(\d+\)", left_out)
    assert "no tests ran" in passed


@pytest.fixture
def after_a_run(tmp_path, monkeypatch):
    """The groups that are remembered after a run of two tests each."""
    monkeypatch.setattr(unchanged, "key_of", lambda name, tests: f"{name} {len(tests)}")

    def remembered(reports, exit_code=pytest.ExitCode.TESTS_FAILED, collected=True):
        leaving_out = LeavingOut(SimpleNamespace(), tmp_path)
        of_node = {"keys": {}, "tests": {}, "left_out": {}}
        for name in ("one", "other"):
            of_node["keys"][name], of_node["tests"][name] = f"{name} 2", [f"{name}/a", f"{name}/b"]
        leaving_out.pytest_testnodedown(SimpleNamespace(workeroutput=of_node))
        leaving_out.pytest_testnodedown(SimpleNamespace())  # a process that crashed
        leaving_out.pytest_collectreport(SimpleNamespace(failed=not collected))
        for nodeid, when, outcome in reports:
            states = {state: outcome == state for state in ("passed", "failed", "skipped")}
            leaving_out.pytest_runtest_logreport(SimpleNamespace(nodeid=nodeid, when=when, **states))
        leaving_out.pytest_sessionfinish(exit_code)
        return sorted(path.name for path in tmp_path.iterdir())

    return remembered


GOOD = [(f"{name}/{test}", "call", "passed") for name in ("one", "other") for test in "ab"]


def test_groups_that_passed_are_remembered(after_a_run):
    assert after_a_run(GOOD) == ["one 2", "other 2"]


@pytest.mark.parametrize(
    "report",
    [
        ("one/b", "call", "failed"),
        ("one/b", "setup", "failed"),
        ("one/b", "teardown", "failed"),
        ("one/b", "???", "failed"),  # the process has crashed
    ],
    ids=lambda report: report[1],
)
def test_a_group_with_a_failure_is_not_remembered(after_a_run, report):
    assert after_a_run([*GOOD, report]) == ["other 2"]


def test_a_group_is_not_remembered_if_a_test_did_not_run(after_a_run):
    assert after_a_run(GOOD[1:]) == ["other 2"]
    assert after_a_run([("one/a", "setup", "passed"), *GOOD[1:]]) == ["other 2"]


def test_tests_that_are_skipped_have_run(after_a_run):
    assert after_a_run([("one/a", "setup", "skipped"), *GOOD[1:]]) == ["one 2", "other 2"]


def test_nothing_is_remembered_of_a_run_that_is_not_whole(after_a_run):
    assert after_a_run(GOOD, pytest.ExitCode.INTERRUPTED) == []
    assert after_a_run(GOOD, collected=False) == []


def test_a_group_is_not_remembered_if_a_file_changed_meanwhile(after_a_run, monkeypatch):
    monkeypatch.setattr(unchanged, "key_of", lambda name, tests: "another")
    assert after_a_run(GOOD) == []


@pytest.mark.parametrize("name", [*NAMES, of_page("docs/method.md").name])
def test_groups_depend_on_files_that_exist(name):
    for pattern in patterns_of(name):
        assert list(REPOSITORY.glob(pattern)), pattern


def test_surroundings_are_the_same_with_folders_of_packages_twice(monkeypatch):
    once = unchanged.surroundings.__wrapped__()
    monkeypatch.setattr(sys, "path", [*sys.path, *sys.path])
    assert unchanged.surroundings.__wrapped__() == once


def test_a_key_depends_on_the_group_its_tests_and_the_surroundings(monkeypatch):
    keys = {key_of(name, tests) for name in ("shell", "query") for tests in (["a"], ["a", "b"])}
    monkeypatch.setattr(unchanged, "surroundings", lambda: "another machine")
    assert len(keys | {key_of("shell", ["a"])}) == 5
