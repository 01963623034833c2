"""Runs cases in processes that may crash or hang, and reports the cases that did."""

import argparse
import collections
import os
import queue
import random
import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
# Seconds for a case; a busy machine takes several times as long as needed.
TIME_LIMIT = 60
# Seconds to import all libraries and to write the valid files.
START_LIMIT = 300
# Processes accumulate leftovers of cases, and libraries leak.
CASES_OF_A_PROCESS = 2000


class Worker:
    """A process of tests/fuzz/worker.py, which is restarted when it ends."""

    def __init__(self, kind, log):
        self._kind, self._log = kind, log
        self._process, self._ran = None, 0

    def run(self, number):
        """The outcome of a case, or the reason why the process died."""
        if self._process is None:
            self._start()
        try:
            self._process.stdin.write(f"{number}\n")
            self._process.stdin.flush()
            line = self._read_line()
        except BrokenPipeError:
            line = ""
        if line is None:
            self.stop()
            return f"FAILED no end within {TIME_LIMIT} s"
        if not line.startswith(f"done {number} "):
            code = self._process.wait()
            self.stop()
            name = signal.Signals(-code).name if code < 0 else f"exit code {code}"
            return f"FAILED crash: {name}"
        self._ran += 1
        if self._ran >= CASES_OF_A_PROCESS:
            self.stop()
        return line.split(" ", 2)[2]

    def stop(self):
        """End the process."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            self._process.stdin.close()
            self._process.stdout.close()
        self._process = None

    def _start(self):
        self._process = subprocess.Popen(
            [sys.executable, "-X", "faulthandler", "-m", "fuzz.worker", self._kind],
            cwd=ROOT,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._log,
            encoding="utf-8",
            env={**os.environ, "OMP_NUM_THREADS": "1"},
        )
        self._ran, self._lines = 0, queue.Queue()
        threading.Thread(target=self._forward, args=(self._process.stdout, self._lines), daemon=True).start()
        if self._read_line(START_LIMIT) != "ready":
            raise RuntimeError("a process of the fuzz tests does not start: see its log")

    @staticmethod
    def _forward(stream, lines):
        try:
            for line in stream:
                lines.put(line.rstrip("\n"))
        except ValueError:  # closed meanwhile
            pass
        lines.put("")

    def _read_line(self, limit=TIME_LIMIT):
        try:
            return self._lines.get(timeout=limit)
        except queue.Empty:
            return None


def run(kind, numbers, *, workers=2, seconds=None, log=None):
    """Run the cases with these numbers; returns the count of each outcome, and the failures by number."""
    counts, failures, numbers = collections.Counter(), {}, iter(numbers)
    end, lock = None if seconds is None else time.monotonic() + seconds, threading.Lock()

    def work():
        with open(log, "a", encoding="utf-8") if log else tempfile.TemporaryFile("w", encoding="utf-8") as file:
            worker = Worker(kind, file)
            try:
                while end is None or time.monotonic() < end:
                    with lock:
                        number = next(numbers, None)
                    if number is None:
                        break
                    outcome = worker.run(number)
                    with lock:
                        counts[outcome.split()[0]] += 1
                        if outcome.startswith("FAILED"):
                            failures[number] = outcome
                            print(f"{kind} {number}: {outcome}", flush=True)
            finally:
                worker.stop()

    threads = [threading.Thread(target=work) for _ in range(workers)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return counts, failures


def main():
    """Run cases for some minutes, half of the time with files and half of the time with calls."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--minutes", type=float, default=10)
    parser.add_argument("--seed", type=int, default=None, help="number of the first case; another one each time")
    parser.add_argument("--kind", choices=("files", "calls"), default=None)
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    parser.add_argument("--log", default=None)
    parser.add_argument("--case", type=int, default=None, help="run this one alone")
    arguments = parser.parse_args()
    kinds = [arguments.kind] if arguments.kind else ["files", "calls"]
    first = random.randrange(1 << 40) if arguments.seed is None else arguments.seed
    failed = False
    for kind in kinds:
        numbers = [arguments.case] if arguments.case is not None else range(first, 1 << 62)
        counts, failures = run(
            kind,
            numbers,
            workers=1 if arguments.case is not None else arguments.workers,
            seconds=60 * arguments.minutes / len(kinds),
            log=arguments.log,
        )
        total = sum(counts.values())
        print(f"{kind} from {first}: {total} cases, {dict(counts)}, {len(failures)} failures", flush=True)
        failed |= bool(failures)
    sys.exit(failed)


if __name__ == "__main__":
    main()
