"""The rows of the benchmark, one module each: what to measure, the goals, and a table of the results.

Each module has `TITLE`, `ABOUT` (how it is measured), `SETTINGS` (the names of the settings that matter),
`measure(settings)`, which yields results that JSON supports, `goals(results)`, a list of `suite.goal.Goal`, and
`table(results)`, Markdown.
`GOALS` are pairs of quantity and goal, shown if nothing could be measured.
"""

from . import (
    accuracy,
    agreement,
    animation,
    answers,
    call,
    certified,
    derivatives,
    distributed,
    escape,
    frame,
    growth,
    importing,
    incoherent,
    large,
    level,
    memory,
    mesh,
    mitsuba,
    packets,
    picture,
    points,
    prefilter,
    primary,
    revisions,
    store,
    view,
)

ROWS = {
    module.__name__.rpartition(".")[2]: module
    for module in (
        primary,
        packets,
        incoherent,
        growth,
        revisions,
        mitsuba,
        level,
        frame,
        animation,
        picture,
        call,
        importing,
        agreement,
        accuracy,
        escape,
        certified,
        derivatives,
        prefilter,
        memory,
        mesh,
        answers,
        points,
        view,
        distributed,
        large,
        store,
    )
}

#: Rows that run only if they are named.
ON_DEMAND = {"large", "store", "revisions"}
