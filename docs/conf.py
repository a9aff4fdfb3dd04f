"""Settings of the documentation site: ``python -m sphinx -W -j 2 -d out/doctrees docs out/site``.

It takes half a minute. ``DOCS_NOTEBOOKS=short`` before it executes the notebooks too, but for those that take minutes,
and ``all`` executes all of them (``python -m pytest -m slow tests/unit/docs`` those that take minutes).
"""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING

DOCS = Path(__file__).resolve().parent
sys.path[:0] = [str(DOCS), str(DOCS.parent)]

from _generate import setup_generated  # noqa: E402 - found through the line above
from _math import setup_mathml  # noqa: E402
from docutils import nodes  # noqa: E402

from models.base.version import project_version  # noqa: E402

if TYPE_CHECKING:
    from sphinx.application import Sphinx
    from sphinx.environment import BuildEnvironment

project = "Gearbox thermal twin"
author = "the authors of the gearbox thermal twin"
copyright = f"{author}, MIT licence"  # noqa: A001 - the name that Sphinx reads
version = release = project_version()

extensions = [
    "myst_nb",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx_click",
    "sphinx_copybutton",
    "sphinx_design",
]
exclude_patterns = ["_*"]
nitpicky = True
smartquotes_action = "qe"  # quotation marks and dots; -- begins an option
add_module_names = False  # they do not fit on narrow screens; the pages name the modules
# Public names are checked; docstrings also name what is inside, which has no page.
nitpick_ignore_regex = [("py:.*", r"(?!gearbox_twin\.).*")]
autodoc_typehints = "none"  # the docstrings have types with shapes and units
numpydoc_show_class_members = False  # autodoc lists them

# Markdown and notebooks. A notebook is committed without outputs and executed where it lies, see `spread_notebooks`.
myst_enable_extensions = ["attrs_inline", "colon_fence", "deflist", "dollarmath", "fieldlist"]
myst_heading_anchors = 3
LONG_NOTEBOOKS = ("concealed_effect", "could_it_have_shown", "wind_turbine")
EXECUTED = os.environ.get("DOCS_NOTEBOOKS", "off")
nb_execution_mode = "off" if EXECUTED == "off" else "auto"
nb_execution_excludepatterns = [f"{name}.ipynb" for name in LONG_NOTEBOOKS if EXECUTED == "short"]
suppress_warnings = [] if EXECUTED == "all" else ["misc.highlighting_failure"]  # the kernel states the language of "!"
nb_execution_timeout = 1800
nb_execution_raise_on_error = True

# Formulas become MathML: browsers draw it without a script and without a network.
html_math_renderer = "mathml"

html_theme = "pydata_sphinx_theme"
html_title = project
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_sidebars = dict.fromkeys(
    ("install", "contributing", "development", "changelog", "genindex", "search"), ()
)  # no pages below
html_theme_options = {
    "navigation_with_keys": False,
    "show_prev_next": True,
    "secondary_sidebar_items": ["page-toc"],
    "header_links_before_dropdown": 6,
    "navbar_persistent": ["search-button"],  # the field does not fit next to the links
    "show_toc_level": 2,
}
html_show_sourcelink = False
html_copy_source = False


def spread_notebooks(_app: Sphinx, _env: BuildEnvironment, docnames: list[str]) -> None:
    """Put half of the notebooks first and half last: Sphinx gives neighbours to one process, and these take longest."""
    notebooks = [name for name in docnames if name.startswith("notebooks/") and name != "notebooks/index"]
    pages = [name for name in docnames if name not in notebooks]
    docnames[:] = [*notebooks[::2], *pages, *notebooks[1::2]]


def mark_literals(_app: Sphinx, _context: object, lines: list[str]) -> None:
    """Set commands, options and addresses in the help of a command as literals."""
    for i, line in enumerate(lines):
        if not line.lstrip().startswith(".. "):
            literal = r"(python -m builder .*|(?<![\w`-])--[a-z][a-zA-Z-]*|tcp://[\w.:]*\w|FILE@FROM\.\.TO)"
            lines[i] = re.sub(literal, r"``\1``", line)


UNITS = "%|°C|degC|K|W|J|s|h|min|m|mm|N|V|nats?|[mu]s|[kMG]B|k[JW]|MW|m/s|rad/s|1/min|[WJ]/K"
SPACE_BEFORE_UNIT = re.compile(rf"(?<=\d) (?=(?:{UNITS})(?!\w))|(?<=\d N) (?=m\b)")


REFERENCE = re.compile(r"\bR[0-9a-f]{12}-(?=\d)")  # what numpydoc puts before the number of a reference


def set_texts(_app: Sphinx, doctree: nodes.document, _docname: str) -> None:
    """Keep a number and its unit on one line, and number references as the docstring does."""
    for text in list(doctree.findall(nodes.Text)):
        if not isinstance(text.parent, nodes.literal | nodes.literal_block | nodes.math | nodes.math_block):
            kept = REFERENCE.sub("", SPACE_BEFORE_UNIT.sub("\N{NO-BREAK SPACE}", text.astext()))
            if kept != text.astext():
                text.parent.replace(text, nodes.Text(kept))


COMMANDS = re.compile(r'(<div class="highlight-(?:bash|console) .*?</pre>)', re.DOTALL)
HYPHENATED = re.compile(r"(?<=[\s>])(?=[\w-]*-)[\w-]+(?=[\s<])")


def keep_options_whole(_app: Sphinx, _page: str, _template: str, context: dict[str, object], _tree: object) -> None:
    """Let the lines of commands break between words only, and not after the hyphens of an option."""
    if isinstance(body := context.get("body"), str):
        pieces = COMMANDS.split(body)
        pieces[1::2] = [HYPHENATED.sub(r'<span class="whole">\g<0></span>', piece) for piece in pieces[1::2]]
        context["body"] = "".join(pieces)


def setup(app: Sphinx) -> None:
    """Register formulas, the order of work, units and literals in the help of commands."""
    setup_mathml(app)
    setup_generated(app)
    app.connect("env-before-read-docs", spread_notebooks)
    app.connect("doctree-resolved", set_texts)
    app.connect("html-page-context", keep_options_whole)
    for part in ("description", "options", "arguments", "epilog"):
        app.connect(f"sphinx-click-process-{part}", mark_literals)
