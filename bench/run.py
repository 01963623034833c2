"""Measure the rows of the benchmark; see bench/README.md.

Each row runs in a process of its own: some peers can end theirs, and memory is measured. Results go to benchmarks.json
in the output folder, in which the rows that are measured now replace those of earlier runs; benchmarks.md and the plots
are made from it.
"""

import argparse
import dataclasses
import json
import subprocess
import sys
import time
import traceback
from pathlib import Path

from report import document
from rows import ON_DEMAND, ROWS
from suite import machine
from suite.peers import Skipped
from suite.settings import Settings

COUNTS = (
    "repetitions",
    "threads",
    "incoherent_rays",
    "agreement_rays",
    "accuracy_rays",
    "escape_rays",
    "points",
    "procedural_size",
    "large_size",
)
LISTS = ("size", "growth_sizes", "level_sizes", "prefilter_sizes", "store_tiles")


def parse(arguments):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "rows", nargs="*", metavar="ROW", help=f"of {', '.join(ROWS)} (default: all but {', '.join(ON_DEMAND)})"
    )
    parser.add_argument("--quick", action="store_true", help="small volumes and few rays: about a minute")
    parser.add_argument("--output", type=Path, default=Path("out/bench"), help="output folder")
    parser.add_argument(
        "--volumes", metavar="TEXT", help="only real volumes whose file name contains this; none for none"
    )
    parser.add_argument("--settings", type=json.loads, help=argparse.SUPPRESS)  # of the process of one row
    for name in COUNTS:
        parser.add_argument(f"--{name.replace('_', '-')}", type=int, metavar="N")
    for name in LISTS:
        parser.add_argument(f"--{name.replace('_', '-')}", type=int, nargs="+", metavar="N")
    options = parser.parse_args(arguments)
    if unknown := [name for name in options.rows if name not in ROWS]:
        parser.error(f"ROW: expected some of {', '.join(ROWS)}, got {', '.join(unknown)}")
    options.rows = options.rows or [name for name in ROWS if name not in ON_DEMAND]
    return options


def settings_of(options):
    names = (*COUNTS, *LISTS, "volumes")
    given = {name: getattr(options, name) for name in names if getattr(options, name) is not None}
    given |= {name: tuple(given[name]) for name in LISTS if name in given}
    return dataclasses.replace(Settings.for_a_minute() if options.quick else Settings(), **given)


def new_entry(settings):
    return {"machine": machine.describe(), "settings": dataclasses.asdict(settings), "results": []}


def run_row(name, settings):
    """The entry of a row in the JSON; after an error, it has the results so far."""
    entry = new_entry(settings)
    start = time.perf_counter()
    try:
        for result in ROWS[name].measure(settings):
            entry["results"].append(result)
            what = ", ".join(str(result[key]) for key in ("subject", "size", "view", "eye") if key in result)
            print(f"  {what}", flush=True)
    except Skipped as reason:
        entry["skipped"] = str(reason)
        print(f"  skipped: {reason}")
    except Exception as error:
        entry["error"] = f"{type(error).__name__}: {error}"
        traceback.print_exc()
    entry["seconds"] = time.perf_counter() - start
    return entry


def read(path):
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}


def write(path, summary):
    path.parent.mkdir(parents=True, exist_ok=True)
    ordered = {name: summary[name] for name in ROWS if name in summary}
    path.write_text(document.to_json(ordered), encoding="utf-8")


def run_in_a_process(name, settings, output):
    """Whether a row was measured or skipped without error. The row's process writes the entry; this function does so if
    the process died."""
    path = output / "benchmarks.json"
    write(path, {row: entry for row, entry in read(path).items() if row != name})
    command = [sys.executable, __file__, name, "--output", output, "--settings"]
    status = subprocess.run([*command, json.dumps(dataclasses.asdict(settings))], check=False).returncode
    summary = read(path)
    if name not in summary:
        write(path, summary | {name: new_entry(settings) | {"error": f"the process ended with status {status}"}})
    return status == 0


def main(arguments=None):
    options = parse(arguments)
    path = options.output / "benchmarks.json"
    if options.settings:
        (name,) = options.rows
        print(f"{name}: {ROWS[name].TITLE}", flush=True)
        entry = run_row(name, Settings(**options.settings))
        write(path, read(path) | {name: entry})
        if entry["results"]:
            print(ROWS[name].table(entry["results"]) + "\n", flush=True)
        return 1 if "error" in entry else 0

    settings = settings_of(options)
    failed = [name for name in options.rows if not run_in_a_process(name, settings, options.output)]
    summary = read(path)
    document.write(summary, options.output)
    print(document.goal_table(summary))
    print(options.output / "benchmarks.md")
    if failed:
        print(f"these rows ended with an error: {', '.join(failed)}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
