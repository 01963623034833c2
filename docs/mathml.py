"""Formulas as MathML: browsers set it themselves, so the pages need no script and no network."""

from docutils.nodes import SkipNode
from latex2mathml.converter import convert


def inline(translator, node):
    translator.body.append(convert(node.astext()))
    raise SkipNode


def displayed(translator, node):
    r"""A formula in a line of its own; `\\` begins another line, & is where lines are aligned."""
    text = node.astext().strip()
    if ("\\\\" in text or "&" in text) and "\\begin" not in text:
        text = f"\\begin{{aligned}}{text}\\end{{aligned}}"
    translator.body.append(f'<div class="formula">{convert(text, display="block")}</div>')
    raise SkipNode


def setup(app):
    app.add_html_math_renderer("mathml", (inline, None), (displayed, None))
