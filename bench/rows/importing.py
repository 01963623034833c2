"""The time of `import isospline`."""

import platform
import statistics
import subprocess
import sys

from suite.clock import spread, take_turns
from suite.goal import at_most
from suite.tables import markdown_table

TITLE = "Import"
ABOUT = """Processes that import NumPy alone and those that import NumPy and isospline take turns; files are in the
system's cache. *isospline* is the difference of the medians."""
SETTINGS = ("repetitions",)
GOALS = [("import isospline, beside NumPy", "at most 0.15 s")]
IMPORTS = {"numpy": "import numpy", "numpy and isospline": "import numpy, isospline"}


def measure(settings):
    calls = {name: lambda code=code: run(code) for name, code in IMPORTS.items()}
    seconds, _ = take_turns(calls, max(settings.repetitions, 3))
    difference = statistics.median(seconds["numpy and isospline"]) - statistics.median(seconds["numpy"])
    yield {
        "python": platform.python_version(),
        "seconds": {name: spread(times) for name, times in seconds.items()},
        "isospline": difference,
    }


def run(code):
    subprocess.run([sys.executable, "-c", code], check=True)


def goals(results):
    return [at_most(GOALS[0][0], 0.15, {f"Python {result['python']}": result["isospline"] for result in results}, "s")]


def table(results):
    rows = [
        (name, *(f"{times[of]:.3f}" for of in ("median", "minimum", "maximum")))
        for result in results
        for name, times in [*result["seconds"].items()]
    ]
    rows += [("isospline", f"{result['isospline']:.3f}", "", "") for result in results]
    return markdown_table(("process", "median, s", "smallest", "largest"), rows)
