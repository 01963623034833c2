"""Rounds of tests/soak/worker.py, each in a new process that may crash or hang; `make soak` runs it."""

import argparse
import os
import random
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
#: Seconds of a round, after those in which it computes the right answers.
ROUND = 300
#: Seconds that a round may take beyond these.
PATIENCE = 600
#: MiB that every second round may use beyond those of its start.
SPARE = 150


def run(seconds, *, seed, spare=None, log=None):
    """The output of a round, and whether it failed."""
    command = [sys.executable, "-m", "soak.worker", "--seconds", str(seconds), "--seed", str(seed)]
    if spare is not None:
        command += ["--spare", str(spare)]
    process = subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.PIPE, stderr=log or subprocess.STDOUT, encoding="utf-8"
    )
    try:
        output, _ = process.communicate(timeout=seconds + PATIENCE)
    except subprocess.TimeoutExpired:
        process.kill()
        output, _ = process.communicate()
        return f"{output}FAILED no end within {seconds + PATIENCE:.0f} s\n", True
    if process.returncode < 0:
        output += f"FAILED crash: signal {-process.returncode}\n"
    return output, process.returncode != 0


def main():
    """Run rounds for some minutes, every second one with little memory."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--minutes", type=float, default=30)
    parser.add_argument("--seed", type=int, default=None, help="of the first round; another one each time")
    parser.add_argument("--log", default=None, help="for what libraries write")
    arguments = parser.parse_args()
    seed = random.randrange(1 << 32) if arguments.seed is None else arguments.seed
    end, failures, number = time.monotonic() + 60 * arguments.minutes, 0, 0
    with open(arguments.log or os.devnull, "a", encoding="utf-8") as log:
        while (left := end - time.monotonic()) > 0 or number == 0:
            spare = SPARE if number % 2 == 1 else None
            print(f"round {number}, seed {seed + number}, {'memory as needed' if spare is None else f'{spare} MiB'}")
            output, failed = run(min(ROUND, max(left, 10)), seed=seed + number, spare=spare, log=log)
            print(output, flush=True)
            failures += failed
            number += 1
    print(f"{number} rounds, {failures} failed")
    sys.exit(failures > 0)


if __name__ == "__main__":
    main()
