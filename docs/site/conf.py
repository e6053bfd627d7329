"""The site: these pages and the docstrings, by Sphinx. `make docs` builds it."""

from __future__ import annotations

import re

from pygments.lexers.special import TextLexer
from sphinx.application import Sphinx

import boresight

project = "Boresight"
author = "the Boresight authors"
copyright = f"{author}, BSD 2-Clause"
release = boresight.__version__
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
exclude_patterns = ["site"]

# Pages are read on other sites too: plain Markdown, headings as targets of links, and blocks
# without a language (drawings) as they are.
myst_heading_anchors = 3
highlight_language = "none"

# Docstrings are numpy's; what stands in single backquotes in them is code.
default_role = "code"
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_use_ivar = True
autodoc_typehints = "none"
autodoc_member_order = "bysource"

html_theme = "furo"
html_title = f"Boresight {release}"
html_show_sourcelink = False
html_copy_source = False
templates_path: list[str] = []

_CODE = re.compile(r"(`+.*?`+)")


def _plain_bars(
    app: object, what: str, name: str, obj: object, options: object, lines: list[str]
) -> None:
    """In docstrings |x| is a length, and no reStructuredText."""
    lines[:] = [
        "".join(p if p.startswith("`") else p.replace("|", r"\|") for p in _CODE.split(line))
        for line in lines
    ]


def setup(app: Sphinx) -> None:
    """What Sphinx asks for."""
    app.connect("autodoc-process-docstring", _plain_bars)
    app.add_lexer("csv", TextLexer)
