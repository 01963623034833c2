"""Configuration of Sphinx: `make docs` builds the site from this folder, the examples and the docstrings."""

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

import gallery
import mathml
import pages

import isospline

project = "isospline"
author = "The isospline developers"
copyright = "2026, the isospline developers, Apache-2.0"
version = release = isospline.__version__

extensions = [
    "myst_parser",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx_copybutton",
    "sphinx_design",
    "sphinx_gallery.gen_gallery",
]
exclude_patterns = ["made/**", "gallery/**/*.ipynb", "gallery/**/*.py", "images/**", "templates/**"]
nitpicky = True
templates_path = ["templates"]

# Markdown, with the anchors that GitHub gives to headings.
myst_enable_extensions = ["colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3
suppress_warnings = ["config.cache"]  # functions of the gallery in this file cannot be pickled

# The reference. Types are in the text of numpydoc's sections, and in the signature they would be there twice.
autodoc_typehints = "none"
autodoc_member_order = "bysource"
autosummary_generate = True
default_role = "py:obj"
numpydoc_show_class_members = False
numpydoc_xref_param_type = False

html_theme = "pydata_sphinx_theme"
html_title = "isospline"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_show_sourcelink = False
html_copy_source = False
html_context = {"default_mode": "auto"}
html_theme_options = {
    "logo": {"text": "isospline"},
    "navbar_align": "left",
    "header_links_before_dropdown": 6,
    "show_toc_level": 2,
    "show_prev_next": False,
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": ["copyright"],
    "footer_end": [],
    "pygments_light_style": "a11y-high-contrast-light",
    "pygments_dark_style": "a11y-high-contrast-dark",
}
html_sidebars = {"index": [], "changelog": [], "install": [], "tutorial": []}
html_math_renderer = "mathml"

sphinx_gallery_conf = gallery.configuration()

# `make docs-links` also asks the servers of other sites.
linkcheck_anchors = False
linkcheck_timeout = 20


def keep_parameter_names(app, environment, node, content):
    """Names in single backticks are objects or parameters; those of no object are set as code, without a warning."""
    if node.get("refdomain") == "py" and node.get("reftype") == "obj":
        return content
    return None


def make_pictures(app):
    """Like Sphinx-Gallery's, these pictures are kept where `-D plot_gallery=0` asks for a quick build."""
    if str(app.config.plot_gallery) in ("0", "False"):
        pages.draw_stand_ins()
    else:
        pages.make_pictures()


def setup(app):
    mathml.setup(app)
    app.connect("missing-reference", keep_parameter_names)
    app.connect("builder-inited", make_pictures, priority=100)
