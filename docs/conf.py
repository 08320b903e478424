"""How the pages become a site: `make docs`.  A warning is an error there."""

import re
from typing import Any

from docutils.nodes import SkipNode
from latex2mathml.converter import convert as mathml
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

html_math_renderer = "mathml"
html_theme = "furo"
html_title = "supremal"
html_copy_source = False
html_show_sphinx = False


def setup(app: Sphinx) -> None:
    """Add what the pages need besides: formulas without a network, links to files, short types."""
    app.add_html_math_renderer("mathml", (_inline, None), (_displayed, None))
    app.connect("source-read", _link_to_files)
    app.connect("autodoc-process-signature", _shorten)


def _inline(writer: Any, node: Any) -> None:  # noqa: ANN401 - Sphinx's
    writer.body.append(mathml(node.astext()))
    raise SkipNode


def _displayed(writer: Any, node: Any) -> None:  # noqa: ANN401 - Sphinx's
    writer.body.append(mathml(node.astext(), display="block"))
    raise SkipNode


def _link_to_files(_app: Sphinx, _page: str, source: list[str]) -> None:
    """Let pages link to those of the examples, which are none of the site, as to any other file."""
    source[0] = re.sub(r"\]\((\.\./examples/[^)]*\.md)\)", r"](<path:\1>)", source[0])


def _shorten(*said: Any) -> tuple[str | None, str | None]:  # noqa: ANN401 - Sphinx's
    """Write an alias as it is written in the code."""
    return tuple(text and re.sub(r"TypeAliasForwardRef\('(\w+)'\)", r"\1", text) for text in said[-2:])
