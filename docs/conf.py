"""Sphinx configuration. The build is strict: every warning is an error (`make docs`)."""

from importlib.metadata import version as installed_version

project = "Foldyn"
author = "The Foldyn developers"
copyright = "The Foldyn developers"
version = release = installed_version("foldyn")

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.mathjax",
    "sphinx.ext.napoleon",
]
exclude_patterns = ["_build"]
html_theme = "furo"
html_title = "Foldyn"

myst_enable_extensions = ["dollarmath", "deflist"]
myst_heading_anchors = 3

# docstrings are NumPy style, with single backticks around code
default_role = "code"
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_use_ivar = True
autodoc_member_order = "bysource"
autodoc_typehints = "none"
autodoc_default_options = {"show-inheritance": True}

# types in docstrings are words ("array_like, shape (n, 3)"), not links; all other links are checked
nitpick_ignore_regex = [(r"py:(class|obj|data|exc)", r".*")]
