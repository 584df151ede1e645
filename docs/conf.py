"""Sphinx: `python -m sphinx -j auto -W --keep-going -b html docs build/docs` (README, "Go on").

Nothing here needs a network: MathJax lies in _static, and no inventory of another project is loaded.
"""

from __future__ import annotations

import sys
from importlib.metadata import version as installed
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE / "_ext"), str(HERE.parent)]

project = "sweep"
author = "The sweep developers"
version = release = installed("rattleback-sweep")

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.mathjax",
    "sphinx_click",
    "sphinx_copybutton",
    "console",
    "docstrings",
    "rooms",
    "tables",
    "thumbnails",
]
exclude_patterns = ["_ext", "_static"]
# A public name stands twice: in `sweep` and in the module that defines it.  References may mean either.
suppress_warnings = ["ref.python"]

# Every reference must lead somewhere, but for types in signatures: those of other packages have no page here.
nitpicky = True
nitpick_ignore_regex = [("py:(class|data|obj|attr|exc)", ".*")]

myst_enable_extensions = ["amsmath", "attrs_block", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3
nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_timeout = 600
nb_merge_streams = True
nb_output_stderr = "remove"  # where progress is shown

default_role = "code"
smartquotes_action = "qe"  # quotes and ellipses, but no dashes: `--fresh` is an option
add_module_names = False
autodoc_member_order = "bysource"
autodoc_mock_imports = ["bokeh"]  # of the extra `explore`
autodoc_typehints = "signature"
autodoc_preserve_defaults = True

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
