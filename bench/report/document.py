"""Makes docs/benchmarks.md from the JSON of a run: goals, tables, plots, machine."""

import importlib.util
import json

from rows import ROWS
from suite.clock import OUTLIER
from suite.goal import skipped
from suite.tables import markdown_table

from . import plots

TIMES = f"""Times are medians, ± half of the range of all runs. All methods of a row are repeated equally often and
take turns: forwards and backwards in Python, in a random order in C++. A time above {OUTLIER:g} times the median of its
method is an outlier: it is replaced by a new measurement. Each method is measured again at most as often as it has
repetitions."""


def row_goals(name, entry):
    if not entry["results"]:
        reason = entry.get("skipped") or entry.get("error", "no volume")
        return [skipped(what, goal, reason) for what, goal in ROWS[name].GOALS]
    return ROWS[name].goals(entry["results"])


def all_goals(summary):
    return [goal for name in ROWS if name in summary for goal in row_goals(name, summary[name])]


def goal_table(summary):
    rows = [(goal.what, goal.goal, goal.measured, goal.verdict) for goal in all_goals(summary)]
    return markdown_table(("what", "goal", "measured: the worst, and where", "verdict"), rows)


def machines(summary):
    """One line for each machine, commit and size of run, with the rows that were measured there."""
    lines = {}
    for name, entry in summary.items():
        machine = entry["machine"]
        versions = ", ".join(f"{key} {value}" for key, value in machine["versions"].items() if value)
        line = (
            f"{machine['cpu']}, {machine['cores']} cores, {machine['platform']}; commit "
            f"{(machine['commit'] or 'unknown')[:10]}, {machine['date'][:10]}"
            f"{', a quick run, not for citing' if entry['settings']['quick'] else ''}; {versions}"
        )
        lines.setdefault(line, []).append(name)
    if len(lines) == 1:
        return next(iter(lines))
    return "\n".join(f"- {', '.join(names)}: {line}" for line, names in lines.items())


def settings_line(row, entry):
    """The settings that matter for a row."""
    found = {name: entry["settings"][name] for name in row.SETTINGS}
    return f"Settings: {', '.join(f'{name} {text_of(value)}' for name, value in found.items())}."


def text_of(value):
    return " x ".join(map(str, value)) if isinstance(value, (list, tuple)) else f"{value:,}"


def to_json(summary):
    """The JSON of a run, one result a line."""
    rows = []
    for name, entry in summary.items():
        fields = [f"  {json.dumps(key)}: {lines_of(value)}" for key, value in entry.items()]
        rows.append(f" {json.dumps(name)}: {{\n" + ",\n".join(fields) + "\n }")
    return "{\n" + ",\n".join(rows) + "\n}\n"


def lines_of(value):
    def text(item):
        return json.dumps(item, default=lambda number: number.item())

    if not isinstance(value, list) or not value:
        return text(value)
    return "[\n" + ",\n".join(f"   {text(item)}" for item in value) + "\n  ]"


def page(summary, images, notes=None):
    """The text of the page; `images` maps names of plots to their addresses, `notes` names of rows to texts."""
    notes = notes or {}
    text = ["# Benchmarks", "", "Written from `benchmarks.json` by a script; `make bench` measures your machine.", ""]
    if summary:
        text += [machines(summary), "", TIMES, "", "## Goals", "", goal_table(summary), ""]
    for name, entry in summary.items():
        row = ROWS[name]
        text += [f"## {row.TITLE}", "", row.ABOUT, "", settings_line(row, entry), ""]
        if "skipped" in entry:
            text += [f"Not measured: {entry['skipped']}.", ""]
        if "error" in entry:
            text += [f"Ended with an error: {entry['error']}.", ""]
        text += [
            line
            for plot in plots.OF_ROW.get(name, ())
            if plot in images
            for line in (f"![{plots.TITLES[plot]}]({images[plot]})", "")
        ]
        if name in notes:
            text += [notes[name].strip(), ""]
        if entry["results"]:
            text += [row.table(entry["results"]), ""]
    return "\n".join(text)


#: Rows whose goals are a comparison with another program or method, or count wrong answers: the README shows them.
HEADLINE = ("level", "frame", "mesh", "mitsuba", "packets", "incoherent", "agreement", "accuracy", "escape")


def headline(summary, image, link):
    """The README's part: comparisons with others, met or missed, and the plot of the growth."""
    shown = [name for name in HEADLINE if name in summary]
    goals = {goal.what: goal.measured for name in shown for goal in row_goals(name, summary[name])}
    lines = [f"![{plots.TITLES['growth']}]({image})", ""] if image else []
    lines += [markdown_table(("", "measured: the worst, and where"), list(goals.items())), ""]
    machines = {f"{entry['machine']['cpu']}, {entry['machine']['cores']} cores" for entry in summary.values()}
    commits = {entry["machine"]["commit"][:10]: entry["machine"]["date"][:10] for entry in summary.values()}
    commits = [f"{commit} ({date})" for commit, date in sorted(commits.items(), key=lambda each: each[1])]
    at = f"commit{'s' * (len(commits) > 1)} {', '.join(commits)}"
    lines += [f"{'; '.join(sorted(machines))}; {at}. How, and everything else: [{link}]({link})."]
    return "\n".join(lines)


def figures(name, entry):
    """The part of another page about one row: its table, and the machine."""
    return "\n".join([ROWS[name].table(entry["results"]), "", machines({name: entry})])


def write(summary, folder):
    """Write the page and its plots to a folder."""
    images = {}
    if importlib.util.find_spec("matplotlib"):
        images = {name: path.name for name, path in plots.write(summary, folder).items()}
    (folder / "benchmarks.md").write_text(page(summary, images), encoding="utf-8")
