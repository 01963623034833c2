"""Rays now beside those of earlier revisions, in turns."""

import tempfile
from pathlib import Path

import against
import numpy as np
from suite.clock import spread
from suite.goal import at_least
from suite.revision import Process, package_of
from suite.tables import markdown_table, with_spread

#: Earlier revisions by name; `old` is the one whose answers the others must have.
EARLIER = {"c6962fb": "c6962fb", "0.2.0": "275fa00"}
#: What is measured, by the rows of against.py.
RAYS = {
    "packets": "primary, in packets",
    "single": "primary, one at a time",
    "bounce": "cosine off the surface",
    "ambient": "ambient occlusion",
}

TITLE = "Earlier revisions"
ABOUT = """The same rays and one thread, in turns, a process for each revision: now, with a settled index, 0.2.0, and
c6962fb, the last revision before bricks of cells replaced boxes of single cells. Rays off the surface are given without
`coherent`, as most callers do. Numbers are rays a second, and how many times as many as before; *differ* is the share
of answers that differ from those of c6962fb by more than 1e-5 of the largest: rays that touch the surface. `make
bench-against REV=...` compares with any revision."""
SETTINGS = ("size", "repetitions")
GOALS = [
    ("packets against c6962fb", "at least 1.5 times"),
    ("single primary rays against c6962fb", "at least 1.3 times"),
    ("rays off the surface against c6962fb", "at least 1.3 times"),
    ("rays of ambient occlusion against c6962fb", "at least 1.3 times"),
]


def measure(settings):
    side = settings.size[0]
    processes = {name: Process(package_of(revision)) for name, revision in EARLIER.items()}
    processes = {"old": processes.pop("c6962fb"), **processes, "now": Process(settled=True)}
    for subject in settings.subjects():
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            against.write(subject, folder, side, degree=2)
            for process in processes.values():
                process.load(folder=name, degree=2)
            for row in RAYS:
                for view, operation in against.operations((side, side))[row].items():
                    _, rates, different = against.compare(operation, processes, folder, settings.repetitions)
                    yield {
                        "subject": subject.name,
                        "view": view,
                        "rays": row,
                        "now": spread(rates["now"]),
                        "c6962fb": spread(np.divide(rates["now"], rates["old"])),
                        "0.2.0": spread(np.divide(rates["now"], rates["0.2.0"])),
                        "different": different["now"],
                    }
    for process in processes.values():
        process.close()


def goals(results):
    def times(row):
        return {f"{r['subject']}, {r['view']}": r["c6962fb"]["median"] for r in results if r["rays"] == row}

    return [
        at_least(what, 1.5 if row == "packets" else 1.3, times(row)) for (what, _), row in zip(GOALS, RAYS, strict=True)
    ]


def table(results):
    rows = [
        (
            result["subject"],
            result["view"],
            RAYS[result["rays"]],
            *(with_spread(result[name]) for name in ("now", *EARLIER)),
            f"{result['different']:.0e}" if result["different"] else "0",
        )
        for result in results
    ]
    header = ("volume", "view", "rays", "now, Mray/s", *(f": {name}" for name in EARLIER), "differ")
    return markdown_table(header, rows)
