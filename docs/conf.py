"""Settings of the documentation site; `make docs` builds it."""

import logging
import os
import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE / "_extensions"))
os.environ["MATPLOTLIBRC"] = str(HERE / "matplotlibrc")  # kernels inherit it
os.environ["JUPYTER_PATH"] = str(HERE / "_extensions" / "jupyter")
os.environ["NO_COLOR"] = "1"
logging.getLogger("traitlets").setLevel(logging.WARNING)

import amb_design  # noqa: E402

project = "amb_design"
author = "The amb_design developers"
copyright = author
version = release = amb_design.__version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "site_notebooks",
    "site_pages",
    "site_tables",
    "site_api",
    "site_layers",
]
exclude_patterns = ["conf.py", "_extensions", "_build", "notebooks", "**.ipynb_checkpoints"]
nitpicky = True
nitpick_ignore_regex = [("py:(class|obj)", ".*")]  # types in docstrings are words, not links
default_role = "py:obj"
highlight_language = "none"
smartquotes = False  # options begin with two hyphens

myst_enable_extensions = ["deflist", "colon_fence"]
myst_heading_anchors = 3

nb_custom_formats = {".py": ["site_notebooks.read", {}]}
nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_timeout = 900
nb_output_stderr = "error"
nb_merge_streams = True

autodoc_typehints = "none"
autodoc_member_order = "bysource"
napoleon_google_docstring = False
napoleon_use_param = False
napoleon_use_rtype = False
napoleon_use_ivar = True

html_theme = "furo"
html_title = "amb_design"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sphinx = False
html_theme_options = {"navigation_with_keys": True}
