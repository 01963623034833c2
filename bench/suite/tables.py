"""Tables of Markdown."""


def power(count):
    """A count as 10^n where it is one: 1e8 reads 10^8."""
    digits = str(count)
    return f"10^{len(digits) - 1}" if set(digits[1:]) == {"0"} and digits[0] == "1" else f"{count:,}"


def markdown_table(header, rows):
    """A table of Markdown; text to the left, and what is not to the right."""
    rows = [list(row) for row in rows]
    right = [all(not isinstance(row[i], str) or row[i] == "-" for row in rows) for i in range(len(header))]
    lines = ["| " + " | ".join(header) + " |", "|" + "|".join("---:" if flag else "---" for flag in right) + "|"]
    lines += ["| " + " | ".join(cell(value) for value in row) + " |" for row in rows]
    return "\n".join(lines)


def cell(value):
    if value is None:
        return "-"
    if isinstance(value, float):
        return f"{value:.0f}" if abs(value) >= 1000 else f"{value:.3g}"
    return str(value)
