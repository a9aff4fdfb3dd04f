"""Formulas of the site as MathML, which browsers draw themselves: no script, no font, no network."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from docutils.nodes import SkipNode
from latex2mathml.converter import convert

if TYPE_CHECKING:
    from docutils.nodes import Element
    from sphinx.application import Sphinx
    from sphinx.writers.html5 import HTML5Translator


# What the converter leaves out: the space between a function and an argument without brackets, an upright letter.
FUNCTION = re.compile(
    r"(\\(?:ln|lg|exp|sin|cos|tan|tanh|max|min)(?![A-Za-z])|\\mathrm\{asinh\})\s*(?=[A-Za-z]|\\(?!left))"
)
LETTER = re.compile(r"\\mathrm\{([A-Za-z])\}")


def mathml(tex: str, display: str) -> str:
    """LaTeX as MathML."""
    return convert(LETTER.sub(r"\\text{\1}", FUNCTION.sub(r"\1\\, ", tex)), display=display)


def _inline(translator: HTML5Translator, node: Element) -> None:
    translator.body.append(mathml(node.astext(), "inline"))
    raise SkipNode  # the children are the source


def _block(translator: HTML5Translator, node: Element) -> None:
    translator.body.append(f'<div class="math-block">{mathml(node.astext(), "block")}</div>')
    raise SkipNode


def setup_mathml(app: Sphinx) -> None:
    """Register ``html_math_renderer = "mathml"``."""
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
