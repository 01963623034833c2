"""Write the table of foreign names in docs/migration.md: ``python docs/names.py``."""

from pathlib import Path

from isospline.base.foreign import table_of_names

PAGE = Path(__file__).with_name("migration.md")
BEGIN, END = "<!-- begin names -->\n", "\n<!-- end names -->"


def with_names(text: str) -> str:
    """The page with the table of the package."""
    before, rest = text.split(BEGIN)
    return before + BEGIN + table_of_names() + END + rest.split(END)[1]


if __name__ == "__main__":
    PAGE.write_text(with_names(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
