"""A private folder that does not outlive its process."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
import weakref

from ..base.system import child_environment

# Waits for the end of the process, whose end closes the pipe, and removes the folder. Signals for the whole group of
# processes must not stop it.
_KEEPER = 'trap "" HUP INT TERM; read -r _; rm -rf -- "$1"'


class TemporaryFolder:
    """A folder for the user alone. It is removed by `remove`, or when the process ends, even by a signal or a crash."""

    def __init__(self):
        self.path = tempfile.mkdtemp(prefix="isospline-")  # with mode 0700
        keeper = subprocess.Popen(
            ["/bin/sh", "-c", _KEEPER, "sh", self.path],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
            cwd="/",
            env=child_environment(),
        )
        self.remove = weakref.finalize(self, _remove, self.path, keeper, os.getpid())

    def folder(self):
        """A new folder in it."""
        return tempfile.mkdtemp(dir=self.path)


def _remove(path, keeper, owner):
    if os.getpid() != owner:  # a forked process, which has neither the folder nor the keeper
        keeper.stdin.close()
        keeper.returncode = 0
        return
    shutil.rmtree(path, ignore_errors=True)
    with keeper:  # closes the pipe, and waits
        keeper.kill()
