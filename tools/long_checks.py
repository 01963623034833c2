"""Run what .ci/run leaves out, and write the result of each part into docs/reliability.md: long_checks.py [PART...]

The rows of parts that are not run stay as they are. The logs are in out/long.
"""

import datetime
import re
import subprocess
import sys
import time
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[1]
PAGE = REPOSITORY / "docs" / "reliability.md"
#: The parts, what they check, and their commands.
PARTS = {
    "tests": ("all tests, also those that take long", "make test-long"),
    "fuzz": ("damaged files and invalid calls, other ones each time", "make fuzz MINUTES=20"),
    "soak": ("threads that change, save, fork and interrupt shared scenes", "make soak MINUTES=20"),
    "debian13": ("all tests of the compiled parts with Embree 4, GCC 14, Python 3.13", "make test-debian13"),
    "torch": ("isospline.torch, with Debian's PyTorch", "make test-torch"),
    "lowest": ("the lowest versions of Python and all packages", "make test-lowest"),
    "address": ("the C++ tests with AddressSanitizer and UndefinedBehaviorSanitizer", "make sanitize-address"),
    "address-python": ("the fast Python tests of the compiled module with both", "make sanitize-python"),
    "thread": ("ThreadSanitizer", "make sanitize-thread"),
    "alone": ("each source compiled alone by Clang: missing includes, shadowed names", "make clang UNITY=OFF"),
    "bench": ("all rows of the benchmark, small", "make bench BENCH=--quick"),
}
ROW = re.compile(r"^\| `([\w-]+)` \|.*$", re.MULTILINE)
MARKED = re.compile(r"(<!-- ci-long -->\n).*?(<!-- /ci-long -->)", re.DOTALL)


def output_of(*command):
    return subprocess.run(command, cwd=REPOSITORY, capture_output=True, check=True, encoding="utf-8").stdout.strip()


def run(part):
    """Run a part; returns its row of the table, and whether it passed."""
    what, command = PARTS[part]
    log = REPOSITORY / "out" / "long" / f"{part}.log"
    log.parent.mkdir(parents=True, exist_ok=True)
    commit = output_of("git", "rev-parse", "--short=10", "HEAD")
    others = ("--", ".", f":!{PAGE.relative_to(REPOSITORY)}")  # this page changes with each part
    changed = " with changes" if output_of("git", "status", "--porcelain", "--untracked-files=no", *others) else ""
    print(f"== {part}: {command} (log: {log})", flush=True)
    began = time.monotonic()
    with log.open("w", encoding="utf-8") as file:
        code = subprocess.run(
            command.split(), cwd=REPOSITORY, stdout=file, stderr=subprocess.STDOUT, check=False
        ).returncode
    minutes = (time.monotonic() - began) / 60
    result = "passed" if code == 0 else f"failed, exit {code}"
    print(f"== {part}: {result} after {minutes:.0f} minutes", flush=True)
    row = f"| `{part}` | {what}: `{command}` | {datetime.date.today()} | {commit}{changed} | {minutes:.0f} | {result} |"
    return row, code == 0


def write(rows):
    """Replace the rows of some parts in the page."""
    text = PAGE.read_text(encoding="utf-8")
    known = {match[1]: match[0] for match in ROW.finditer(MARKED.search(text)[0])} | rows
    head = "| part | what | last run | commit | minutes | result |\n|---|---|---|---|---:|---|\n"
    table = head + "".join(f"{known[part]}\n" for part in PARTS if part in known)
    PAGE.write_text(MARKED.sub(lambda match: f"{match[1]}{table}{match[2]}", text), encoding="utf-8")


def main():
    wanted = sys.argv[1:] or list(PARTS)
    unknown = set(wanted) - set(PARTS)
    if unknown:
        sys.exit(f"PARTS: expected some of {', '.join(PARTS)}, got {', '.join(sorted(unknown))}")
    passed = True
    for part in wanted:
        row, is_good = run(part)
        write({part: row})
        passed &= is_good
    sys.exit(not passed)


if __name__ == "__main__":
    main()
