"""How Sphinx builds the guide: ``sphinx-build -W docs contactlib-guide``.

Pages are Markdown whose cells run during the build, in a scratch folder of their own. Everything
that the site shows is inside it, so that it opens from a file without a network.
"""

import os
import sys
from pathlib import Path

GUIDE = Path(__file__).parent
sys.path.insert(0, str(GUIDE))  # for `generators` and `notebooks`
folders = [str(GUIDE.parent / "models"), os.environ.get("PYTHONPATH", "")]
os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, folders))  # cells import the locomotive
os.environ["MATPLOTLIBRC"] = str(GUIDE / "matplotlibrc")  # one look of all figures

project = "contactlib"
author = "The contactlib founders"
extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "numpydoc",
    "sphinx_click",
    "generators",
    "notebooks",
]
exclude_patterns = ["**/.ipynb_checkpoints"]

highlight_language = "none"  # a page names the language of a block that is not of a shell
suppress_warnings = ["myst-nb.lexer"]  # with nb_execution_mode=off no kernel names its language
nitpicky = True  # a link that leads nowhere is a warning, and -W makes it an error
default_role = "py:obj"  # `Name` in a docstring leads to it if the guide has it

myst_enable_extensions = ["colon_fence", "deflist", "dollarmath", "fieldlist"]
myst_heading_anchors = 3
nb_execution_mode = "force"
nb_execution_in_temp = True
nb_execution_raise_on_error = True
nb_execution_timeout = 600  # of a cell, on a slow core
nb_merge_streams = True
nb_ipywidgets_js: dict[str, dict[str, str]] = {}  # they would come from the network

autodoc_typehints = "none"  # the docstrings contain the types
autodoc_preserve_defaults = True
autodoc_member_order = "bysource"
numpydoc_show_class_members = False

html_theme = "furo"
html_title = "contactlib guide"
html_math_renderer = "mathml"  # of `generators`: browsers set it by themselves
html_static_path = ["_static"]
html_css_files = ["guide.css"]
html_copy_source = False
html_show_copyright = False
html_show_sphinx = False
