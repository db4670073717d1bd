"""Sphinx configuration. The build is strict: every warning is an error (`make docs`)."""

from importlib.metadata import version as installed_version
from pathlib import Path

import jupytext

project = "Foldyn"
author = "The Foldyn developers"
copyright = "The Foldyn developers"
version = release = installed_version("foldyn")

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.mathjax", "sphinx.ext.napoleon"]
exclude_patterns = ["_build"]
html_theme = "furo"
html_title = "Foldyn"

myst_enable_extensions = ["dollarmath", "deflist"]
myst_heading_anchors = 3

# Notebooks are scripts. They run here (by nbclient) and nowhere else, so that what they show is
# what Foldyn computes now; one that raises an error or warns fails the build.
HERE = Path(__file__).parent
(HERE / "notebooks").mkdir(exist_ok=True)
for script in (HERE.parent / "examples" / "notebooks").glob("*.py"):
    made = HERE / "notebooks" / f"{script.stem}.ipynb"
    if not made.exists() or made.stat().st_mtime < script.stat().st_mtime:
        notebook = jupytext.read(script)
        notebook.metadata["kernelspec"] = {"name": "python3", "display_name": "Python 3"}
        jupytext.write(notebook, made)
nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_timeout = 300  # s, of a cell
nb_output_stderr = "warn"

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
