"""XML that is not trusted: its elements, with the places where they stand.

The parser refuses entities and references to other files; depth and number of elements have bounds.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from io import BytesIO
from typing import Any, Final
from xml.sax import SAXParseException, handler
from xml.sax.xmlreader import AttributesNSImpl, Locator

from supremal.errors import FormatError
from supremal.formats import model
from supremal.formats._names import escape, unescape
from supremal.formats._page import Page, shown

MAX_DEPTH: Final = 100
MAX_ELEMENTS: Final = 2_000_000

_SHIFT: Final = 1 << 32
_ENTITIES: Final = {
    ord(character): f"&{entity};"
    for character, entity in {
        "&": "amp",
        "<": "lt",
        ">": "gt",
        '"': "quot",
        "\n": "#10",
        "\r": "#13",
        "\t": "#9",
    }.items()
}
_NOT_XML: Final = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


class Markup(Page):
    """A page whose offsets are a line and a column in one number, as the parser gives the two."""

    def place(self, where: int) -> tuple[int, int]:
        """Return line and column, counted from 1."""
        return divmod(where, _SHIFT)


class Element:
    """An element: its name and attributes without their namespaces, and its children."""

    __slots__ = ("attributes", "children", "tag", "where")

    def __init__(self, tag: str, attributes: dict[str, str], where: int) -> None:
        self.tag, self.attributes, self.where = tag, attributes, where
        self.children: list[Element] = []

    def all(self, tag: str) -> Iterator[Element]:
        """Give the children that are called ``tag``."""
        return (child for child in self.children if child.tag == tag)


class _Handler(handler.ContentHandler):
    """Builds the tree."""

    def __init__(self, page: Markup) -> None:
        super().__init__()
        self.page = page
        self.open = [Element("", {}, 0)]
        self.count = 0
        self.locator: Locator | None = None

    def setDocumentLocator(self, locator: Locator) -> None:  # noqa: N802 - the parser calls it so
        self.locator = locator

    def startElementNS(  # noqa: N802 - the parser calls it so
        self,
        name: tuple[str | None, str],
        qname: str | None,  # noqa: ARG002 - the parser gives it
        attrs: AttributesNSImpl,
    ) -> None:
        where = _where(self.locator)
        self.count += 1
        if len(self.open) > MAX_DEPTH:
            self.page.fail(f"elements are nested more than {MAX_DEPTH} deep", where)
        if self.count > MAX_ELEMENTS:
            self.page.fail(f"more than {MAX_ELEMENTS:,} elements, the most that are read", where)
        attributes = {key[1]: value for key, value in attrs.items()}
        element = Element(name[1], attributes, where)
        self.open[-1].children.append(element)
        self.open.append(element)

    def endElementNS(self, name: object, qname: object) -> None:  # noqa: ARG002, N802 - the parser calls it so
        self.open.pop()


def _where(locator: Any) -> int:  # noqa: ANN401 - a locator or an error, which tell their place alike
    line, column = locator.getLineNumber() or 0, locator.getColumnNumber() or 0
    return int(line) * _SHIFT + int(column) + 1


def parse(raw: bytes, path: str) -> tuple[Markup, Element]:
    """Return the page and the root element."""
    from defusedxml.common import DefusedXmlException
    from defusedxml.expatreader import create_parser

    page = Markup(path)
    if len(raw) > model.MAX_BYTES:
        page.fail(model.too_large(model.MAX_BYTES))
    builder = _Handler(page)
    parser = create_parser()
    parser.setFeature(handler.feature_namespaces, True)
    parser.setContentHandler(builder)
    try:
        parser.parse(BytesIO(raw))
    except FormatError:
        raise
    except SAXParseException as error:
        page.fail(f"this is not XML: {error.getMessage()}", _where(error))
    except DefusedXmlException as error:
        what = type(error).__name__.removesuffix("Forbidden").lower()
        page.fail(
            f"the file declares an entity or refers to another file ({what}); remove that", _where(parser)
        )
    except (LookupError, ValueError) as error:
        page.fail(f"this is not XML that can be read: {error}; save the file as UTF-8")
    return page, builder.open[0].children[0]


def attribute(page: Page, element: Element, name: str) -> str:
    """Return an attribute that has to be there."""
    if name not in element.attributes:
        page.fail(f"<{element.tag}> has no attribute {name!r}", element.where)
    return unescape(element.attributes[name])


def flag(page: Page, element: Element, name: str, *, default: bool) -> bool:
    """Return an attribute that is true or false."""
    text = element.attributes.get(name)
    if text is None:
        return default
    if text.strip() not in {"true", "false", "1", "0"}:
        page.fail(f"{name!r} of <{element.tag}> is {shown(text)}; true or false is needed", element.where)
    return text.strip() in {"true", "1"}


def start_tag(tag: str, attributes: Mapping[str, str], *, end: str = ">") -> str:
    """Return a start tag; characters that XML cannot hold are escaped in the attributes."""
    pairs = (f' {key}="{escape(value, _NOT_XML).translate(_ENTITIES)}"' for key, value in attributes.items())
    return f"<{tag}{''.join(pairs)}{end}"


def nested(lines: Iterable[str]) -> str:
    """Return ``lines`` of tags as an XML document, each indented by its depth."""
    text, depth = ['<?xml version="1.0" encoding="UTF-8"?>'], 0
    for line in lines:
        depth -= line.startswith("</")
        text.append("  " * depth + line)
        depth += not (line.startswith("</") or line.endswith("/>"))
    return "\n".join(text) + "\n"
