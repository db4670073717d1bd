"""Charts of constitutive curves: moments of folds and bends, stress of bars."""

from __future__ import annotations

from collections import Counter

import numpy as np
from numpy.typing import NDArray

from foldyn.materials.series import in_series
from foldyn.plots.charts import Chart, Curve
from foldyn.shells import Shell
from foldyn.structures import Structure
from foldyn.structures.discretized import HingeKind

MOST_CURVES = 4
POINTS = 359
# A law may grow without bound towards 0 and 360 degrees, so a narrower range of angles sets the
# height of the frame.
_FRAMED = (20.0, 340.0)


def law_charts(
    structure: Structure | Shell, stretch: tuple[float, float] = (0.8, 1.2)
) -> list[Chart]:
    """Curves of a structure's laws, a chart for each kind of element.

    Hinges of equal stiffness and rest angle share a curve; each chart shows at most four curves,
    for the largest groups of hinges. Moments (N m) are of whole creases, dihedrals in degrees,
    stresses in Pa. The last curve of a chart marks the states at rest.
    """
    kinds = [own for kind in structure.hinge_kinds for own in kind.by_law]
    charts = [_hinges(kind) for kind in kinds if len(kind.nodes)]
    if structure.bar_law is not None:
        modulus, x = structure.sheet.youngs_modulus, np.linspace(*stretch, POINTS)
        y = modulus * np.asarray(structure.bar_law.stress(x))
        curves = [Curve(f"bar: E {modulus:.4g} Pa", x, y), _at_rest([(1.0, 0.0)])]
        title, label = f"bars: {structure.bar_law.name}", "second Piola-Kirchhoff stress (Pa)"
        charts.append(Chart("stretch (-)", label, curves, title, zero=True))
    return charts


def _at_rest(states: list[tuple[float, float]]) -> Curve:
    return Curve("at rest", *np.transpose(states), dots=True)


def _hinges(hinges: HingeKind) -> Chart:
    """Chart of the moment curves of one kind of hinge."""
    kind, stiffness, rest = hinges.name, hinges.stiffness, hinges.rest
    degrees = np.linspace(1.0, 359.0, POINTS)
    framed = (degrees >= _FRAMED[0]) & (degrees <= _FRAMED[1])
    groups, reach = _distinct(stiffness, rest), 0.0
    curves: list[Curve] = []
    states: list[tuple[float, float]] = []
    for first, count in groups[:MOST_CURVES]:
        k, theta0, law = float(stiffness[first]), float(rest[first]), hinges.law_of(first)
        share = hinges.share[first]
        moment = k * in_series(law, np.radians(degrees), theta0, share)[1]
        j, m = hinges.nodes[first][:2]
        label = f"{kind} {j}-{m}"
        label += f" and {count - 1} more" if count > 1 else ""
        angle = float(np.degrees(theta0))
        label += f": k {k:.4g} N m/rad, rest {angle:.4g}°"
        states.append((angle, k * float(in_series(law, theta0, theta0, share)[1])))
        curves.append(Curve(label, degrees, moment))
        reach = max(reach, float(np.abs(moment[framed]).max()))
    hidden = len(groups) - MOST_CURVES
    note = f"{hidden} other pairs of k and rest not shown" if hidden > 0 else ""
    title = f"{kind}s: {hinges.law.name}"
    if (elastic := hinges.law.elastic) is not hinges.law:
        title += f" (its elastic part, {elastic.name})"
    curves.append(_at_rest(states))
    labels = "dihedral (degrees)", "moment (N m)"
    return Chart(*labels, curves, title, note, 1.08 * reach, zero=True)


def _distinct(stiffness: NDArray, rest: NDArray) -> list[tuple[int, int]]:
    """First index and count of hinges with equal stiffness and rest angle, most frequent first."""
    looks = [f"{k:.6e} {theta0:.6f}" for k, theta0 in zip(stiffness, rest, strict=True)]
    first = {look: k for k, look in reversed(list(enumerate(looks)))}
    return [(first[look], count) for look, count in Counter(looks).most_common()]
