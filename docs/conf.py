"""Settings of the documentation site, which ``./run docs`` builds.

The folder ``generated`` holds what the extensions write: executed scripts, and pages from
docstrings, the schema of study files and the parsers of commands.
"""

import sys
from importlib.metadata import version as version_of
from importlib.util import find_spec
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE / "extensions"))

project = "polychirp"
author = "The polychirp authors"
copyright = author  # noqa: A001
version = release = version_of("polychirp")

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_gallery.gen_gallery",
    "docstrings",
    "root_pages",
    "study_file",
    "commands",
    "packages",
    "accessibility",
]
exclude_patterns = [
    "_build",
    "extensions",
    "images",
    "gallery",
    "tutorials",
    "generated/**/*.ipynb",
]
suppress_warnings = [
    "ref.python",  # two modules may have a type of the same name
    "config.cache",  # scrapers and sort keys are functions
]
default_role = "py:obj"
# colours with the contrast that WCAG asks for
pygments_style = "a11y-high-contrast-light"
pygments_dark_style = "a11y-high-contrast-dark"

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4
# one file that draws equations without fonts: docs/adr/0013-mathjax-from-a-package.md
mathjax_package = Path(find_spec("sphinx-mathjax-offline").submodule_search_locations[0])
mathjax_path = "tex-svg.js"

toc_object_entries = False  # the sidebar of each page would hold thousands
autodoc_typehints_format = "short"
autodoc_member_order = "bysource"
napoleon_google_docstring = False

sphinx_gallery_conf = {
    "examples_dirs": ["tutorials", "gallery"],
    "gallery_dirs": ["generated/tutorials", "generated/gallery"],
    "filename_pattern": "/(plot|tutorial)_",
    "within_subsection_order": "FileNameSortKey",
    "image_scrapers": ("matplotlib", "drawings.drawings"),
    "abort_on_example_error": True,
    "download_all_examples": False,
    "show_signature": False,
    "show_memory": False,
    "min_reported_time": 1e6,
    "remove_config_comments": True,
    "plot_gallery": True,
    "write_computation_times": False,
}

html_theme = "furo"
html_title = "polychirp"
html_static_path = ["static", str(mathjax_package / "static" / "mathjax" / mathjax_path)]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sourcelink = False
html_show_sphinx = False
