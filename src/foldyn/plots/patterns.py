"""Pictures of patterns side by side: flat patterns from above, folded patterns in space."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from foldyn.errors import InputError
from foldyn.patterns import Pattern
from foldyn.plots import scene, style
from foldyn.plots.scene import Seen, Sheet3D, View
from foldyn.plots.sheet import DrawnSheet, edge_keys

FLAT = 1e-6  # patterns up to this height, relative to their size, are drawn from above
_ABOVE, _ASLANT = (90.0, -90.0), (28.0, -60.0)
_MARGIN, _CAPTION, _LEGEND = 0.15, 0.3, 0.35  # inches


def draw_patterns(
    patterns: Pattern | Sequence[Pattern],
    captions: Sequence[str] = (),
    *,
    views: Sequence[tuple[float, float] | None] = (),
    tallest: float = 2.6,
    width: float = 7.0,
    title: str = "",
) -> Figure:
    """Draw patterns side by side, each as large as its space allows.

    Parameters
    ----------
    patterns : Pattern or sequence of Pattern
    captions : sequence of str
        Text below each pattern.
    views : sequence of tuple of float, or None
        Elevation above the xy plane and azimuth around z (degrees) for each pattern. None, the
        default, shows a flat pattern from above and a folded pattern from the front.
    tallest : float
        Height of the largest picture (inches).
    width : float
        Width of the figure (inches).
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        Orthographic views without axes, with the legend of the creases below.

    Raises
    ------
    InputError
        No pattern.

    Examples
    --------
    >>> import foldyn as fd
    >>> states = [fd.patterns.miura((3, 2), dihedral=angle) for angle in (180, 90)]
    >>> figure = fd.plots.draw_patterns(states, ["flat", "folded"])
    """
    several = patterns if isinstance(patterns, Sequence) else [patterns]
    sheets = [Sheet3D.of(pattern) for pattern in several]
    if not sheets:
        raise InputError(" is empty: give at least one pattern", "patterns")
    sights = [
        View(*(_ABOVE if np.ptp(sheet.nodes[:, 2]) < FLAT * sheet.size else _ASLANT))
        if view is None
        else View(*view)
        for view, sheet in zip([*views, *[None] * (len(sheets) - len(views))], sheets, strict=True)
    ]
    cell = width / len(sheets)
    flat = [sight.flat(sheet.nodes) for sight, sheet in zip(sights, sheets, strict=True)]
    scales = [min((cell - 2 * _MARGIN) / np.ptp(x[:, 0]), tallest / np.ptp(x[:, 1])) for x in flat]
    high = max(scale * np.ptp(x[:, 1]) for scale, x in zip(scales, flat, strict=True))
    top = 0.42 if title else _MARGIN
    low = _LEGEND + (_CAPTION if any(captions) else 0.1)
    height = top + high + low
    figure = style.new_figure(width, height, title, constrained=False)
    keys = {key.get_label(): key for sheet in sheets for key in edge_keys(sheet)}
    texts = [*captions, *[""] * (len(sheets) - len(captions))]
    for k, (sheet, sight, x, scale, text) in enumerate(
        zip(sheets, sights, flat, scales, texts, strict=True)
    ):
        seen = Seen.of(sheet.nodes, sight)
        aside = scale * (sight.flat(seen.middle) - 0.5 * (x.min(axis=0) + x.max(axis=0)))
        middle = (k + 0.5) * cell, low + 0.5 * high
        axes = scene.add_view(figure, seen, (middle[0] + aside[0], middle[1] + aside[1]), scale)
        axes.set_axis_off()
        DrawnSheet(axes, sheet, sheet.nodes, sight)
        spot = middle[0] / width, (low - 0.06) / height
        figure.text(*spot, text, ha="center", va="top", **style.TEXT)
    return style.finish(figure, [*keys.values()], 5)
