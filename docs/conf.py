"""How the pages become a site: `make docs`.  A warning is an error there."""

import re

from sphinx.application import Sphinx

from supremal import __version__

project = "supremal"
author = "The supremal authors"
copyright = author  # noqa: A001 - Sphinx asks for this name
version = release = __version__

extensions = [
    "myst_parser",
    *(f"sphinx.ext.{name}" for name in ("autodoc", "autosummary", "napoleon", "viewcode")),
]
templates_path = ["templates"]
exclude_patterns = ["templates"]
myst_enable_extensions = ["deflist", "dollarmath"]
myst_heading_anchors = 3

autosummary_generate = ["reference.rst"]
default_role = "py:obj"  # a name in backticks is a link where there is something of that name
add_module_names = False
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_type_aliases = {"Bools": "Bools", "Ints": "Ints", "Floats": "Floats", "Longs": "Longs"}
autodoc_mock_imports = [
    "moviepy",
    "pettingzoo",
    "pyarrow",
    "ray",
    "sb3_contrib",
    "stable_baselines3",
    "torch",
]
napoleon_google_docstring = False
napoleon_use_rtype = False

html_theme = "furo"
html_title = "supremal"
html_copy_source = False
html_show_sphinx = False


def setup(app: Sphinx) -> None:
    """Let pages link to those of the examples, which are none of the site, as to any other file."""
    app.connect("source-read", _link_to_files)


def _link_to_files(_app: Sphinx, _page: str, source: list[str]) -> None:
    source[0] = re.sub(r"\]\((\.\./examples/[^)]*\.md)\)", r"](<path:\1>)", source[0])
