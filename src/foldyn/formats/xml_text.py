"""The only entry for XML: no custom entities, no external parts, limited depth."""

from __future__ import annotations

import re
from xml.etree.ElementTree import Element, ParseError

from foldyn.errors import InputError
from foldyn.values import shortened

DEEPEST = 100
"""Largest number of levels of nested elements."""
# largest numbers: characters searched, entities, characters of the result
_FIRST, _MOST, _LARGEST = 20_000, 50, 1 << 26
_SUBSET = re.compile(r"<!DOCTYPE[^\[>]{0,500}\[([^\]]*)\]\s{0,9}>")
_ENTITY = re.compile(
    r"<!ENTITY\s{1,9}([A-Za-z_][\w.-]{0,50})\s{1,9}([\"'])([^\"'<>]{0,200})\2\s{0,9}>"
)


def from_xml(text: str, what: str) -> Element:
    """Root element of an XML text.

    Parameters
    ----------
    text : str
        The file's content; a DOCTYPE may name a DTD, which is not read.
    what : str
        What the file should be, for messages: "an SVG file".

    Raises
    ------
    InputError
        The text is not XML, has entities or external parts, or is nested too deep.
    """
    from defusedxml import DefusedXmlException, ElementTree

    try:
        root = ElementTree.fromstring(_without_abbreviations(text), forbid_dtd=False)
    except DefusedXmlException:
        raise InputError(
            f"is not {what} that can be read safely: it defines entities of entities, or names "
            "other files; save it again without them"
        ) from None
    except (ParseError, ValueError, LookupError) as error:
        raise InputError(f"is not {what}: {shortened(str(error))}") from None
    level = [root]
    for _ in range(DEEPEST):
        level = [child for element in level for child in element]
        if not level:
            return root
    raise InputError(f"is not {what}: elements are nested deeper than {DEEPEST} levels")


def _without_abbreviations(text: str) -> str:
    """Expand entities that abbreviate short words, as in Illustrator's files.

    If there are other entities, the text stays unchanged and is refused later.
    """
    subset = _SUBSET.search(text[:_FIRST])
    if not subset:
        return text
    words = {name: value for name, _, value in _ENTITY.findall(subset[1])}
    rest = _ENTITY.sub("", subset[1])
    if rest.strip() or len(words) > _MOST or any("&" in v or "%" in v for v in words.values()):
        return text
    body = text[subset.end() :]
    for name, value in words.items():
        body = body.replace(f"&{name};", value)
        if len(body) > _LARGEST:
            return text
    return text[: subset.start()] + body


def local(element: Element) -> str:
    """Name of an element without its namespace; "" for comments."""
    return element.tag.rpartition("}")[2] if isinstance(element.tag, str) else ""
