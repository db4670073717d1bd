"""Reports: one self-contained HTML page of text, tables and pictures."""

from foldyn.plots.charts import Chart, Curve
from foldyn.report.page import write_report
from foldyn.report.sections import Charts, Heading, Listing, Picture, Section, Table, Text

__all__ = [
    "Chart",
    "Charts",
    "Curve",
    "Heading",
    "Listing",
    "Picture",
    "Section",
    "Table",
    "Text",
    "write_report",
]
