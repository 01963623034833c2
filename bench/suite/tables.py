"""Markdown tables."""


class Number(str):
    """The text of a number, which is aligned to the right in a table."""


def power(count):
    """The text of a count, as 10^n if it is a power of ten: 1e8 becomes 10^8."""
    digits = str(count)
    return f"10^{len(digits) - 1}" if set(digits[1:]) == {"0"} and digits[0] == "1" else f"{count:,}"


def with_spread(values, factor=1):
    """The median, and half of the range of all runs as a percentage of it."""
    median = values["median"]
    return Number(f"{cell(factor * median)} ±{50 * (values['maximum'] - values['minimum']) / median:.0f}%")


def markdown_table(header, rows):
    """A Markdown table; text is aligned to the left, numbers to the right."""
    rows = [list(row) for row in rows]
    right = [all(is_number(row[i]) for row in rows) for i in range(len(header))]
    lines = ["| " + " | ".join(header) + " |", "|" + "|".join("---:" if flag else "---" for flag in right) + "|"]
    lines += ["| " + " | ".join(cell(value) for value in row) + " |" for row in rows]
    return "\n".join(lines)


def is_number(value):
    return not isinstance(value, str) or isinstance(value, Number) or value == "-"


def cell(value):
    if value is None:
        return "-"
    if isinstance(value, float):
        return f"{value:.0f}" if abs(value) >= 1000 else f"{value:.3g}"
    return str(value)
