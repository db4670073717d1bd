"""Figures of structures, laws, loads, motions, equilibrium paths, modes and responses.

Every function returns a `matplotlib.figure.Figure`, ready for ``figure.savefig(path)``; `animate`
and `animate_modes` write a GIF or an MP4. Matplotlib is imported on first use, and its global state
is never touched.
"""

from __future__ import annotations

from foldyn.facade import lazy

ANIMATIONS = ("gif", "mp4")
"""File formats of animations."""
FIGURES = ("png", "svg", "pdf")
"""File formats of figures that commands can write."""

__getattr__, __dir__, __all__ = lazy(__name__, __file__, "ANIMATIONS", "FIGURES")
