"""A part of `make fuzz`, the same in every run: no crash, no hang, no excessive memory, no wrong data."""

import subprocess
import sys

import pytest

pytestmark = pytest.mark.slow

for package in ("meshio", "nibabel", "nrrd", "pydicom", "pyvista", "SimpleITK", "tifffile", "trimesh"):
    pytest.importorskip(package)


def run(repository, kind, count):
    """Run a number of cases, beginning with a fixed one, in a process that is not shared with other tests."""
    script = (
        "import sys\nfrom fuzz.runner import run\n"
        f"counts, failures = run({kind!r}, range(1, {count} + 1), workers=1)\n"
        f"assert sum(counts.values()) == {count}, counts\n"
        "sys.exit(bool(failures))"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=repository / "tests", capture_output=True, encoding="utf-8"
    )
    assert done.returncode == 0, done.stdout + done.stderr[-2000:]


def test_changed_files_are_read_or_refused(repository):
    run(repository, "files", 300)


def test_invalid_calls_return_or_raise(repository):
    run(repository, "calls", 300)


def test_every_public_callable_is_called(repository, tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(repository / "tests"))
    from fuzz import call_table

    called = {name for name, _, _ in call_table.calls(call_table.objects(), tmp_path)}
    assert not call_table.public_names() - called
