"""Write docs/benchmarks.md, its plots and the figures of README and docs/distributed.md from the JSON of a run:
publish.py [FILE]

FILE replaces docs/benchmarks.json. Without FILE, docs/benchmarks.json is used as it is. The texts of
bench/notes/ROW.md, on goals that were missed, go below the heading of their row.
"""

import json
import re
import shutil
import sys
from pathlib import Path

from report import document, plots

REPOSITORY = Path(__file__).resolve().parents[1]
MARKED = re.compile(r"(<!-- benchmarks -->\n).*?(<!-- /benchmarks -->)", re.DOTALL)


def notes(repository=REPOSITORY):
    return {
        path.stem: path.read_text(encoding="utf-8") for path in sorted((repository / "bench" / "notes").glob("*.md"))
    }


def page(repository=REPOSITORY):
    """The text of docs/benchmarks.md."""
    return document.page(read(repository), plot_addresses(repository), notes(repository))


def readme(repository=REPOSITORY):
    """The text of README.md."""
    image = "docs/images/bench-growth.png" if "growth" in plot_addresses(repository) else None
    headline = document.headline(read(repository), image, "docs/benchmarks.md")
    return MARKED.sub(
        lambda match: f"{match[1]}{headline}\n{match[2]}", (repository / "README.md").read_text(encoding="utf-8")
    )


def distributed(repository=REPOSITORY):
    """The text of docs/distributed.md."""
    entry = read(repository).get("distributed")
    figures = document.figures("distributed", entry) if entry else "Not measured yet."
    text = (repository / "docs" / "distributed.md").read_text(encoding="utf-8")
    return MARKED.sub(lambda match: f"{match[1]}{figures}\n{match[2]}", text)


def read(repository):
    return json.loads((repository / "docs" / "benchmarks.json").read_text(encoding="utf-8"))


def plot_addresses(repository):
    folder = repository / "docs" / "images"
    return {name: f"images/bench-{name}.png" for name in plots.TITLES if (folder / f"bench-{name}.png").exists()}


def main():
    docs = REPOSITORY / "docs"
    if len(sys.argv) > 1:
        shutil.copyfile(sys.argv[1], docs / "benchmarks.json")
    plots.write(read(REPOSITORY), docs / "images")
    (docs / "benchmarks.md").write_text(page(), encoding="utf-8")
    (REPOSITORY / "README.md").write_text(readme(), encoding="utf-8")
    (docs / "distributed.md").write_text(distributed(), encoding="utf-8")


if __name__ == "__main__":
    main()
