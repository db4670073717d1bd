"""The interactive part of a page: results in three dimensions, with charts that follow."""

from foldyn.viewer.backdrop import Backdrop, projection
from foldyn.viewer.stage import Stage, rest_stage, stage

__all__ = ["Backdrop", "Stage", "projection", "rest_stage", "stage"]
