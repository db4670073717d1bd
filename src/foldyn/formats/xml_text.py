"""The one door for XML: no entities, no external parts, no depth."""

from __future__ import annotations

from xml.etree.ElementTree import Element, ParseError

from defusedxml import DefusedXmlException, ElementTree

from foldyn.errors import InputError
from foldyn.values import shortened

DEEPEST = 100
"""Levels of nested elements."""


def from_xml(text: str, what: str) -> Element:
    """Root element of an XML text.

    Parameters
    ----------
    text : str
        The file's content; a DOCTYPE may name a DTD, which is not read.
    what : str
        What it should be, for messages: "an SVG file".

    Raises
    ------
    InputError
        No XML, with entities or parts in other files, or nested too deep.
    """
    try:
        root = ElementTree.fromstring(text, forbid_dtd=False)
    except DefusedXmlException:
        raise InputError(
            f"is not {what} that can be read safely: it defines entities or names other files; "
            "save it anew without them (in Illustrator without its editing capabilities)"
        ) from None
    except (ParseError, ValueError, LookupError) as error:
        raise InputError(f"is not {what}: {shortened(str(error))}") from None
    level = [root]
    for _ in range(DEEPEST):
        level = [child for element in level for child in element]
        if not level:
            return root
    raise InputError(f"is not {what}: elements are nested deeper than {DEEPEST} levels")


def local(element: Element) -> str:
    """Name of an element without its namespace; "" for comments."""
    return element.tag.rpartition("}")[2] if isinstance(element.tag, str) else ""
