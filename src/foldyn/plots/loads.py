"""Load histories of a case."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

from foldyn.errors import InputError
from foldyn.plots import style

if TYPE_CHECKING:
    from foldyn.cases import Case

_SAMPLES = 2001
_LISTED_NODES = 3


def plot_load_history(case: Case, duration: float, title: str = "") -> Figure:
    """Draw the loads of a case over time.

    One curve per load history: the force at the most heavily loaded of its nodes, that is the
    largest magnitude among the nodes times the factor of the history. Gravity has axes of its
    own, with the magnitude of its acceleration times the factor.

    Parameters
    ----------
    case : Case
        The loads are its ``force_terms`` and ``gravity_terms``.
    duration : float
        End of the time axis (s).
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        Where the duration is not positive.
    """
    if not (np.isfinite(duration) and duration > 0.0):
        raise InputError(f"duration: {duration!r}; give a positive number of seconds")
    panels = [
        ("force at a node (N)", [(f, describe_load(f), h) for f, h in case.force_terms]),
        ("gravity (m/s2)", [(g, describe_gravity(g), h) for g, h in case.gravity_terms]),
    ]
    panels = [panel for panel in panels if panel[1]] or panels[:1]
    figure = style.new_figure(6.5, 2.9 + 1.7 * (len(panels) - 1))
    style.title_above(figure, title)
    rows = figure.subplots(len(panels), sharex=True, squeeze=False)[:, 0]
    time = np.linspace(0.0, duration, _SAMPLES)
    handles = []
    for axes, (ylabel, terms) in zip(rows, panels, strict=True):
        style.frame(axes, "time (s)" if axes is rows[-1] else "", ylabel)
        for vectors, text, history in terms:
            peak = np.linalg.norm(vectors, axis=-1).max()
            factor = np.broadcast_to(np.asarray(history(time), dtype=np.float64), time.shape)
            (line,) = axes.plot(
                time,
                peak * factor,
                label=f"{text}: {history_name(history)}",
                **style.line_style(len(handles)),
            )
            line.set_linewidth(1.6)
            handles.append(line)
        axes.axhline(0.0, color=style.GRAY, linewidth=0.8, zorder=1)
        style.exponents(axes)
    rows[-1].set_xlim(0.0, duration)
    if handles:
        style.legend_below(figure, handles, columns=1)
    else:
        rows[0].text(
            0.5,
            0.6,
            "no loads",
            transform=rows[0].transAxes,
            ha="center",
            fontsize=style.LABEL,
            color=style.BLACK,
        )
    return style.finish(figure)


def describe_load(vectors: np.ndarray) -> str:
    """Say in words where a load acts, in which direction, and how large it is at a node."""
    size = np.linalg.norm(vectors, axis=1)
    nodes = np.flatnonzero(size > 0.0)
    listed = ", ".join(str(node) for node in nodes[:_LISTED_NODES])
    if nodes.size > _LISTED_NODES:
        listed += f" and {nodes.size - _LISTED_NODES} more"
    where = f"node {listed}" if nodes.size == 1 else f"nodes {listed}"
    unit = vectors[nodes] / size[nodes, None]
    text = f"{size.max():.4g} N"
    if nodes.size and np.abs(unit - unit[0]).max() < 1e-9:
        text += f" along {_direction(unit[0])}"
    if nodes.size and np.ptp(size[nodes]) > 1e-9 * size.max():
        text = "up to " + text
    return f"{text} on {where}"


def describe_gravity(acceleration: np.ndarray) -> str:
    """Say in words how large an acceleration of gravity (3,) is and where it points."""
    size = float(np.linalg.norm(acceleration))
    text = f"gravity {size:.4g} m/s2"
    return f"{text} along {_direction(acceleration / size)}" if size else text


def _direction(unit: np.ndarray) -> str:
    """Name of an axis, or the components of a unit vector (3,)."""
    axis = int(np.abs(unit).argmax())
    if abs(unit[axis]) > 1.0 - 1e-12:
        return f"{'-' if unit[axis] < 0 else '+'}{'xyz'[axis]}"
    return "(" + ", ".join(f"{c:.3g}" for c in unit) + ")"


def history_name(history: Any) -> str:
    """Name a history by its class and numbers, "half sine (duration 0.5)"."""
    history = getattr(history, "function", history)  # a user's function is known by its own name
    kind = type(history)
    fields = getattr(kind, "__dataclass_fields__", None)
    if fields is None:
        return str(getattr(history, "__name__", kind.__name__)).strip("<>")
    words = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", kind.__name__).lower()
    numbers = []
    for name in fields:
        value = getattr(history, name)
        if isinstance(value, int | float | np.number):
            numbers.append(f"{name} {float(value):.4g}")
    return f"{words} ({', '.join(numbers)})" if numbers else words
