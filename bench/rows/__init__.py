"""The rows of the benchmark, one a module: what to measure, what was aimed at, and a table of what came.

Each module has `TITLE`, `ABOUT` (how it is measured), `SETTINGS` (names of those that shape it), `measure(settings)`,
which yields results that JSON knows, `goals(results)`, a list of `suite.goal.Goal`, and `table(results)`, Markdown.
`GOALS` are pairs of what and goal, for where nothing could be measured.
"""

from . import (
    accuracy, agreement, animation, box_edge, call, escape, frame, growth, incoherent, large, level, memory, mesh,
    mitsuba, packets, picture, prefilter, primary, view,
)  # fmt: skip

ROWS = {
    module.__name__.rpartition(".")[2]: module
    for module in (
        primary, packets, incoherent, growth, mitsuba, level, frame, animation, picture, call, box_edge, agreement,
        accuracy, escape, prefilter, memory, mesh, view, large,
    )
}  # fmt: skip

#: Rows that run only where they are named.
ON_DEMAND = {"large"}
