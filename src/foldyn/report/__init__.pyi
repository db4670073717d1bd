# Public names and where they live; loaded when they are first used (facade.py)

from foldyn.plots.charts import Chart as Chart, Curve as Curve
from foldyn.report.page import write_report as write_report
from foldyn.report.sections import (
    Charts as Charts,
    Heading as Heading,
    Listing as Listing,
    Picture as Picture,
    Section as Section,
    Table as Table,
    Text as Text,
)
