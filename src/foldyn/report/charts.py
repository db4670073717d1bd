"""Interactive charts of a page: curves as numbers, drawn by the page's script."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

from foldyn.plots.charts import Chart


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
