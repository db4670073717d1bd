"""Analyses of case files: reading the file, computing, writing the page."""

from foldyn.analyses.casefile import Analysis, CaseFile, Computation, Output
from foldyn.analyses.reading import read_case
from foldyn.analyses.registry import ANALYSES

__all__ = ["ANALYSES", "Analysis", "CaseFile", "Computation", "Output", "read_case"]
