"""The rows of the benchmark, one a module: what to measure, what was aimed at, and a table of what came.

Each module has `TITLE`, `ABOUT` (how it is measured), `measure(settings)`, which yields results that JSON knows,
`goals(results)`, a list of `suite.goal.Goal`, and `table(results)`, Markdown. `GOALS` are pairs of what and goal, for
where nothing could be measured.
"""

from . import (
    accuracy, agreement, escape, frame, growth, incoherent, level, memory, mitsuba, prefilter, primary,
)  # fmt: skip

ROWS = {
    module.__name__.rpartition(".")[2]: module
    for module in (
        primary, incoherent, mitsuba, frame, agreement, accuracy, escape, prefilter, level, memory, growth
    )
}  # fmt: skip
