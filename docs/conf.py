"""Sphinx: `python -m sphinx -j auto -W --keep-going -b html docs build/docs` (docs/how-to/develop.md).

Pages are plain Markdown that can be read without it.  Building them runs nothing and needs no network: MathJax lies in
_static.
"""

from __future__ import annotations

import re
import sys
from importlib.metadata import version as installed
from pathlib import Path

from sphinx.application import Sphinx

sys.path[:0] = [str(Path(__file__).parents[1])]

project = "sweep"
author = "The sweep developers"
version = release = installed("rattleback-sweep")

extensions = ["myst_parser", "sphinx.ext.mathjax", "sphinx_copybutton"]
exclude_patterns = ["_static"]

myst_enable_extensions = ["dollarmath"]
myst_fence_as_directive = ["math"]
myst_heading_anchors = 3

smartquotes_action = "qe"  # quotes and ellipses, but no dashes: `--fresh` is an option

copybutton_prompt_text = "$ "

html_theme = "furo"
html_title = "sweep"
html_static_path = ["_static"]
html_css_files = ["narrow.css"]
html_show_copyright = False
html_copy_source = False
mathjax_path = "mathjax/tex-svg-full.js"
# Accessibility and menus would load further files, which are not here.
mathjax3_config = {"options": {"enableMenu": False}}


def _add_contents(_app: Sphinx, name: str, source: list[str]) -> None:
    """Make a menu of the pages that an index lists."""
    if name.rpartition("/")[2] == "index":
        pages = re.findall(r"^- .*?\[[^\]]+\]\(([\w/-]+)\.md\)", source[0], re.MULTILINE)
        source[0] += "\n".join(["", "```{toctree}", ":hidden:", "", *pages, "```", ""])


def setup(app: Sphinx) -> None:
    app.connect("source-read", _add_contents)
