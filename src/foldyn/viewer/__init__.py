"""The interactive part of a page: results in three dimensions, with charts that follow."""

from foldyn.viewer.stage import Stage, stage

__all__ = ["Stage", "stage"]
