"""Figures of structures, laws, loads, motions, equilibrium paths, modes and responses.

Every function returns a `matplotlib.figure.Figure`, ready for ``figure.savefig(path)``; `animate`
and `animate_modes` write a GIF or an MP4. Matplotlib is imported on first use, and its global state
is never touched.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from foldyn.plots.animation import animate
    from foldyn.plots.energies import plot_energies
    from foldyn.plots.frf import plot_frf
    from foldyn.plots.history import plot_history
    from foldyn.plots.laws import plot_laws
    from foldyn.plots.loads import plot_load_history
    from foldyn.plots.mac import plot_mac
    from foldyn.plots.mode_film import animate_modes
    from foldyn.plots.modes import draw_modes
    from foldyn.plots.nyquist import plot_nyquist
    from foldyn.plots.overlay import draw_overlay
    from foldyn.plots.path import (
        moved_supports,
        plot_load_displacement,
        plot_reaction,
        total_reaction,
    )
    from foldyn.plots.path_energies import energy_shares, plot_path_energies
    from foldyn.plots.shapes import chosen_points, draw_shapes
    from foldyn.plots.structure import draw_structure
    from foldyn.plots.tracks import plot_steps, plot_tracks

ANIMATIONS = ("gif", "mp4")
"""Kinds of animation that can be written."""

__all__ = [
    "ANIMATIONS",
    "animate",
    "animate_modes",
    "chosen_points",
    "draw_modes",
    "draw_overlay",
    "draw_shapes",
    "draw_structure",
    "energy_shares",
    "moved_supports",
    "plot_energies",
    "plot_frf",
    "plot_history",
    "plot_laws",
    "plot_load_displacement",
    "plot_load_history",
    "plot_mac",
    "plot_nyquist",
    "plot_path_energies",
    "plot_reaction",
    "plot_steps",
    "plot_tracks",
    "total_reaction",
]

_HOMES = {
    "animate": "animation",
    "animate_modes": "mode_film",
    "chosen_points": "shapes",
    "draw_modes": "modes",
    "draw_overlay": "overlay",
    "draw_shapes": "shapes",
    "draw_structure": "structure",
    "energy_shares": "path_energies",
    "moved_supports": "path",
    "plot_energies": "energies",
    "plot_frf": "frf",
    "plot_history": "history",
    "plot_laws": "laws",
    "plot_load_displacement": "path",
    "plot_load_history": "loads",
    "plot_mac": "mac",
    "plot_nyquist": "nyquist",
    "plot_path_energies": "path_energies",
    "plot_reaction": "path",
    "plot_steps": "tracks",
    "plot_tracks": "tracks",
    "total_reaction": "path",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
