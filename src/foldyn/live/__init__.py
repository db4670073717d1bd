"""The live viewer: a case file with sliders, results and patterns in a browser and in notebooks."""

from foldyn.live.embedded import View, view
from foldyn.live.server import Server

__all__ = ["Server", "View", "view"]
