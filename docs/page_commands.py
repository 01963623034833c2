"""What runs in place of `pip` and `isospline view` in the commands of pages (pages.py), without its imports."""

import importlib.metadata
import os
import re
import signal
import subprocess
import sys
import urllib.request
from pathlib import Path


def serve(arguments):
    """Run `isospline view`, load its page, and end it as Ctrl-C does."""
    command = [str(Path(sys.executable).with_name("isospline")), *arguments]
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # which the command inherits, and jobs in the background ignore
    environment = {**os.environ, "BROWSER": "true", "PYTHONFAULTHANDLER": "1"}
    process = subprocess.Popen(command, stdout=subprocess.PIPE, encoding="utf-8", env=environment)
    try:
        address = next(word for line in process.stdout for word in line.split() if word.startswith("http://"))
        with urllib.request.urlopen(address, timeout=60) as page:
            assert b"<html" in page.read()
        process.send_signal(signal.SIGINT)
        return process.wait(60) not in (0, 130)
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGABRT)  # prints what each thread was doing
        process.wait()


def check_extras(arguments):
    """Whether the package has the extras that `pip install isospline[...]` names."""
    known = importlib.metadata.metadata("isospline").get_all("Provides-Extra")
    named = [extra for word in arguments for list_ in re.findall(r"\[(.*?)\]", word) for extra in list_.split(",")]
    return any(extra not in known for extra in named)


if __name__ == "__main__":
    sys.exit(serve(sys.argv[1:]) if sys.argv[1] == "view" else check_extras(sys.argv[1:]))
