"""How Sphinx makes the site of the Markdown in docs/ and of the package's docstrings: make docs."""

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
sys.path[:0] = [str(HERE), str(ROOT)]

import uuv_marl  # noqa: E402

project, author, copyright = "uuv_marl", "The uuv_marl developers", "The uuv_marl developers, MIT licence"  # noqa: A001
version = release = uuv_marl.__version__
html_title = f"uuv_marl {release}"
extensions = [
    "myst_nb",
    "autoapi.extension",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "sphinx_copybutton",
    "extension",
]
root_doc = "README"
exclude_patterns = ["docs/site", "uuv_marl", "examples"]

# The pages are written for a code host; it makes the same anchors of the headings.
myst_heading_anchors = 6
nb_execution_mode = "off"  # make notebooks has run them

# The code is read, not imported: compiled functions keep their signatures, and no extra has to be installed.
autoapi_dirs = [str(ROOT / "uuv_marl")]
autoapi_ignore = ["*/uuv_marl/cli/*"]  # uuv-marl --help is its reference
autoapi_root = "api"
autoapi_add_toctree_entry = False
autoapi_keep_files = True
autoapi_options = ["members", "undoc-members", "show-inheritance", "show-module-summary", "imported-members"]
autoapi_python_class_content = "class"
autoapi_member_order = "bysource"
# Constants that are unpacked from a range are imported by modules that do not show them.
suppress_warnings = ["autoapi.python_import_resolution"]

nitpicky = True
# Objects of other libraries: their pages lie outside, and the site asks for nothing there.
nitpick_ignore_regex = [("py:.*", r"(?!uuv_marl\b).*"), ("py:obj", r".* \| None")]

html_theme = "furo"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_show_sphinx = False
html_copy_source = False
copybutton_exclude = ".linenos, .gp, .go"
