"""Sections of a report: headings, text, tables, pictures and charts, each written as HTML."""

from __future__ import annotations

import base64
import json
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from io import BytesIO
from numbers import Integral, Real
from os import PathLike
from pathlib import Path
from typing import Any

from foldyn.errors import InputError
from foldyn.plots.charts import Chart

_WIDE = 1200  # pixels; wider pictures scroll on a phone, where they would be too small to read


@dataclass(frozen=True)
class Heading:
    """A heading of a part (level 2) or of a section within a part (level 3).

    Headings of level 2 are listed at the top of the page.
    """

    text: str
    level: int = 2

    def __post_init__(self) -> None:
        """Check the level."""
        if self.level not in (2, 3):
            raise InputError(f"level: {self.level!r}; a heading in a report has level 2 or 3")

    def html(self, anchor: str = "") -> str:
        """Write as HTML, with an anchor to jump to."""
        name = f' id="{escape(anchor)}"' if anchor else ""
        return f"<h{self.level}{name}>{escape(self.text)}</h{self.level}>"


@dataclass(frozen=True)
class Text:
    """Plain text; an empty line starts a new paragraph."""

    text: str

    def html(self) -> str:
        """Write as HTML."""
        paragraphs = re.split(r"\n\s*\n", self.text.strip())
        return "\n".join(f"<p>{escape(paragraph.strip())}</p>" for paragraph in paragraphs)


@dataclass(frozen=True)
class Table:
    """A table with a header row.

    Parameters
    ----------
    header : sequence of str
        Titles of the columns, with units.
    rows : sequence of sequences
        Cells: text unchanged, numbers to `digits` digits, None as an empty cell, True and False as
        yes and no.
    caption : str
        Written above the table.
    digits : int
        Significant digits of numbers that are not integers.
    sorts : bool
        Whether a click on a title sorts the rows by that column.
    """

    header: Sequence[str]
    rows: Sequence[Sequence[Any]]
    caption: str = ""
    digits: int = 4
    sorts: bool = True

    @classmethod
    def of(cls, columns: Mapping[str, Iterable[Any]], caption: str = "", digits: int = 4) -> Table:
        """Make a table of columns by their titles."""
        rows = [[*row] for row in zip(*columns.values(), strict=True)]
        return cls(list(columns), rows, caption, digits)

    def __post_init__(self) -> None:
        """Check that rows fit the header."""
        for number, row in enumerate(self.rows):
            if len(row) != len(self.header):
                raise InputError(
                    f"rows[{number}]: {len(row)} cells under {len(self.header)} column titles; "
                    "use None for an empty cell"
                )

    def html(self) -> str:
        """Write as HTML."""
        caption = f"<caption>{escape(self.caption)}</caption>" if self.caption else ""
        numeric = [
            any(_is_number(row[k]) for row in self.rows)
            and all(_is_number(row[k]) or row[k] is None for row in self.rows)
            for k in range(len(self.header))
        ]
        kind = [' class="number"' if right else "" for right in numeric]
        columns = []
        for k, right in enumerate(numeric):
            cells = [self._cell(row[k]) for row in self.rows]
            columns.append(_aligned(cells) if right else [f"<td>{escape(c)}</td>" for c in cells])
        heads = zip(self.header, kind, strict=True)
        titles = "".join(f'<th scope="col"{k}>{escape(title)}</th>' for title, k in heads)
        body = "\n".join(f"<tr>{''.join(row)}</tr>" for row in zip(*columns, strict=True))
        return (
            f'<div class="table{"" if self.sorts else " kept"}"><table>{caption}\n'
            f"<thead><tr>{titles}</tr></thead>\n<tbody>\n{body}\n</tbody></table></div>"
        )

    def _cell(self, value: Any) -> str:
        if value is None:
            return ""
        if isinstance(value, bool) or type(value).__name__ == "bool":  # includes the type of numpy
            return "yes" if value else "no"
        if isinstance(value, Integral):
            return str(int(value))
        if isinstance(value, Real):
            return rounded(float(value), self.digits)
        return str(value)


@dataclass(frozen=True)
class Listing:
    """Verbatim text, such as an input file; a click on the title shows it."""

    title: str
    text: str

    def html(self) -> str:
        """Write as HTML."""
        return (
            f"<details><summary>{escape(self.title)}</summary>"
            f"<pre>{escape(self.text)}</pre></details>"
        )


@dataclass(frozen=True)
class Picture:
    """A figure, an animation or a film, stored inside the page.

    Parameters
    ----------
    source : path-like, bytes, or a matplotlib Figure
        A PNG, GIF, JPEG or MP4 file, its bytes, or anything with
        ``savefig(file, format="png")``.
    caption : str
        Written below the picture.
    alt : str
        Description of the picture for readers who cannot see it; by default the caption.
    """

    source: Any
    caption: str = ""
    alt: str = ""

    def html(self) -> str:
        """Write as HTML."""
        content = self._bytes()
        data = base64.b64encode(content).decode("ascii")
        alt = escape(self.alt or self.caption)
        caption = f"<figcaption>{escape(self.caption)}</figcaption>" if self.caption else ""
        if content[4:8] == b"ftyp":
            return (
                f'<figure><video aria-label="{alt}" controls loop autoplay muted playsinline '
                f'src="data:video/mp4;base64,{data}"></video>{caption}</figure>'
            )
        kind, width, height = self._picture(content)
        wide = ' class="wide"' if width > _WIDE else ""
        return (
            f'<figure><div{wide}><img alt="{alt}" width="{width}" height="{height}" '
            f'src="data:{kind};base64,{data}"></div>{caption}</figure>'
        )

    def _picture(self, content: bytes) -> tuple[str, int, int]:
        """Kind of a picture, its width and its height (pixels)."""
        from PIL import Image, UnidentifiedImageError

        try:
            with Image.open(BytesIO(content), formats=("PNG", "GIF", "JPEG")) as picture:
                return f"image/{str(picture.format).lower()}", picture.width, picture.height
        except UnidentifiedImageError:
            raise InputError(f"source: {self._name()} is no PNG, GIF, JPEG or MP4") from None

    def _bytes(self) -> bytes:
        if isinstance(self.source, bytes | bytearray):
            return bytes(self.source)
        if isinstance(self.source, str | PathLike):
            path = Path(self.source)
            if not path.is_file():
                raise InputError(f"source: there is no picture {path}")
            return path.read_bytes()
        if hasattr(self.source, "savefig"):
            buffer = BytesIO()
            self.source.savefig(buffer, format="png")
            return buffer.getvalue()
        raise InputError(f"source: {self._name()}; give a path, bytes or a matplotlib Figure")

    def _name(self) -> str:
        is_path = isinstance(self.source, str | PathLike)
        return str(self.source) if is_path else f"an object of type {type(self.source).__name__}"


@dataclass(frozen=True)
class Charts:
    """Charts side by side, with a caption below them."""

    charts: Sequence[Chart]
    caption: str = ""

    def html(self) -> str:
        """Write as HTML; the page must have the script."""
        caption = f"<figcaption>{escape(self.caption)}</figcaption>" if self.caption else ""
        inside = "\n".join(map(_html, self.charts))
        return f'<figure><div class="plots">{inside}</div>{caption}</figure>'


def _html(chart: Chart) -> str:
    title = f"<h3>{escape(chart.title)}</h3>" if chart.title else ""
    note = f"<p>{escape(chart.note)}</p>" if chart.note else ""
    text = json.dumps(chart.about(), separators=(",", ":"))
    return f'<div>{title}<div class="plot" data-plot="{escape(text)}"></div>{note}</div>'


Section = Heading | Text | Table | Listing | Picture | Charts


def rounded(value: float, digits: int) -> str:
    """Write a number with some significant digits, with an exponent only if very small or large."""
    text = f"{value:.{digits}g}"
    if 1e-4 <= abs(value) < 1e6 and "e" in text:
        return f"{float(text):.0f}"
    return text


def _aligned(cells: Sequence[str]) -> list[str]:
    """Table cells of a column of numbers, which the page's style aligns at the decimal point.

    Numbers with fewer characters after the point than the longest number get the missing characters
    as invisible filling. An exponent counts as characters after the point.
    """
    tails = [re.search(r"[.e].*", text) for text in cells]
    found = ["" if tail is None else tail[0] for tail in tails]
    longest = max(found, key=len, default="")
    lacks = [longest[len(tail) :] if text else "" for text, tail in zip(cells, found, strict=True)]
    fills = [f' data-lacks="{lack}"' if lack else "" for lack in lacks]
    filled = zip(cells, fills, strict=True)
    return [f'<td class="number"{fill}>{escape(text)}</td>' for text, fill in filled]


def cell(value: float) -> float | None:
    """A number for a table cell; None, an empty cell, if it is not finite."""
    return float(value) if math.isfinite(value) else None


def _is_number(value: Any) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool)
