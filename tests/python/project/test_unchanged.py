"""`make test` leaves out groups of tests that have passed for the same files."""

import re
import subprocess
import sys
from types import SimpleNamespace

import pytest
from unchanged import GROUPS, REPOSITORY, TESTS, LeavingOut, key_of, patterns_of


def last_lines(folder):
    command = [sys.executable, "-m", "pytest", "-q", "--numprocesses", "1", "-p", "no:cacheprovider"]
    options = [f"--leave-out-unchanged={folder}", f"{TESTS}/shell/test_levels.py"]
    ended = subprocess.run([*command, *options], cwd=REPOSITORY, capture_output=True, encoding="utf-8", check=False)
    return ended.stdout.strip().splitlines()[-2:]


@pytest.mark.slow
def test_what_has_passed_is_left_out(tmp_path):
    assert re.fullmatch(r"\d+ passed in .*", last_lines(tmp_path)[1])
    left_out, passed = last_lines(tmp_path)
    assert re.fullmatch(r"left out, because they passed for the same files: shell \(\d+\)", left_out)
    assert "no tests ran" in passed


def test_a_key_depends_on_the_volumes_that_are_there(monkeypatch):
    keys = {key_of(GROUPS[0])}
    for folder in ("one", "other"):
        monkeypatch.setenv("ISOSPLINE_VOLUMES", folder)
        keys.add(key_of(GROUPS[0]))
    assert len(keys) == 3


@pytest.mark.parametrize(
    ("exit_code", "remembered"), [(pytest.ExitCode.TESTS_FAILED, ["good"]), (pytest.ExitCode.INTERRUPTED, [])]
)
def test_only_whole_groups_without_a_failure_are_remembered(tmp_path, exit_code, remembered):
    leaving_out = LeavingOut(SimpleNamespace(), tmp_path)
    for key, outcome in [("good", "passed"), ("bad", "passed"), ("bad", "failed"), ("nothing ran", "skipped")]:
        leaving_out.pytest_runtest_logreport(SimpleNamespace(user_properties=[("group", key)], outcome=outcome))
    leaving_out.pytest_sessionfinish(exit_code)
    assert [path.name for path in tmp_path.iterdir()] == remembered


@pytest.mark.parametrize("group", GROUPS, ids=lambda group: group.name)
def test_groups_depend_on_files_that_exist(group):
    for pattern in patterns_of(group):
        assert list(REPOSITORY.glob(pattern)), pattern


def test_each_group_has_its_own_key():
    assert len({key_of(group) for group in GROUPS}) == len(GROUPS)
