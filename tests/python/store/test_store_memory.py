"""Memory of the steps of a conversion that come before its first block."""

import subprocess
import sys
import textwrap

import pytest

pytest.importorskip("zarr")


def test_a_raw_file_is_opened_without_its_samples_in_memory(tmp_path):
    """Pages of a file that is mapped count as memory of the process, and a check looks at samples all over the file."""
    with open(tmp_path / "a.raw", "wb") as file:
        file.truncate(700**3)
    script = f"""
        import pathlib
        from isospline.store.sources.opening import open_source

        def most():
            lines = pathlib.Path("/proc/self/status").read_text(encoding="ascii").splitlines()
            return next(1024 * int(line.split()[1]) for line in lines if line.startswith("VmHWM"))

        before = most()
        open_source({str(tmp_path / "a.raw")!r}, "zyx", dict(shape=(700,) * 3, dtype="u1", offset=0, name=None))
        print(most() - before)
    """
    command = [sys.executable, "-c", textwrap.dedent(script)]
    told = subprocess.run(command, capture_output=True, encoding="utf-8")
    assert told.returncode == 0 and int(told.stdout) < 30e6, told
