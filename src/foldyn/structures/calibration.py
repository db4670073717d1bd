"""Stiffness of folds, bends and bars: MERLIN2's calibration from the sheet, or given for creases.

With G = E t^3 / (12 (1 - nu^2)) and Ls the length-scale ratio:
fold of length Lf            1/kf = Ls/G + 1/(0.55 G (Lf/t)^(1/3)), whole crease;
bend on a spoke (N5B8)       G (D/t)^(1/3)/D times the spoke's length, D = spoke + opposite spoke;
bend on a diagonal (N4B5)    the same with D the diagonal, times D;
bars of an N5B8 quad         t |H^2 - nu W^2| / (2 H (1 - nu^2)) for edges 1 and 3, H and W
                             exchanged for edges 2 and 4, t nu (H^2 + W^2)^1.5 / (2 H W (1 - nu^2))
                             for spokes; W, H the mean lengths of edges 1, 3 and of edges 2, 4;
bars of every other panel    2 S t / ((1 - nu) sum L) for edges and inner bars alike.

Sources: Filipov et al., Int. J. Solids Struct. 124, 2017; Liu and Paulino (MERLIN2). MERLIN2
assigns bend stiffnesses and bar areas in a different order than the formulas say;
`calibration="merlin2"` reproduces that order exactly (`_merlin2_corners`, `_merlin2_edges`), as
published results depend on it.

Stiffness and rest angles can also be given: for all creases, for each one, or by name.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.arguments import arguments
from foldyn.errors import InputError, warn
from foldyn.patterns import Pattern
from foldyn.patterns.crease_data import crease_rows, crease_values
from foldyn.patterns.topology import around, edge_of
from foldyn.structures.material_axes import bending_across
from foldyn.structures.mesh import Mesh, double_areas, lengths
from foldyn.structures.sheet import Sheet
from foldyn.structures.strip import Strip
from foldyn.tables import read
from foldyn.values import doubt_degrees, number, numbers, show, single

STIFFEST = 1e100  # N/m or kg: above this, or below its inverse, squares and quotients overflow
SAME = 1e-9  # thicknesses with a smaller relative difference count as equal
WEAK = 1e-3  # bar area/(thickness times side) below which a panel is (almost) free to shear


def calibrated_folds(length: NDArray, pattern: Pattern, sheet: Sheet) -> NDArray:
    """Stiffness of whole creases (nf,), N m/rad, of the given lengths (m).

    The two sides of a crease are springs in series. Each has half the compliance of a crease
    between two panels like the one on that side. G of an orthotropic panel is that across the
    crease.
    """
    g = bending_across(pattern, sheet)
    t = sheet.values("thickness", len(pattern.faces))[pattern.crease_faces]
    slender = 0.55 * g * (length[:, None] / t) ** (1.0 / 3.0)
    compliance = sheet.length_scale_ratio / g + 1.0 / slender
    return 1.0 / (0.5 * (compliance[:, 0] + compliance[:, 1]))


def bend_stiffness_per_length(d: NDArray, g: NDArray, t: NDArray) -> NDArray:
    """Stiffness of a bend per length of the bend (N/rad), if the panel's diagonal is d (m)."""
    return g * (d / t) ** (1.0 / 3.0) / d


def bend_stiffness(mesh: Mesh, pattern: Pattern, sheet: Sheet, merlin2: bool) -> NDArray:
    """Stiffness of each whole bend (N m/rad), in the mesh's order."""
    vector = mesh.nodes[mesh.inner[:, 1]] - mesh.nodes[mesh.inner[:, 0]]
    length = np.linalg.norm(vector, axis=1)
    if not len(length):
        return length
    count = len(pattern.faces)
    g = sheet.values("bending_modulus", count)[mesh.inner_panel]
    t = sheet.values("thickness", count)[mesh.inner_panel]
    if (mesh.centers[mesh.inner_panel] < 0).all():
        return bend_stiffness_per_length(length, g, t) * length
    per_length = np.empty(len(length))
    _, first, spokes = np.unique(mesh.inner_panel, return_index=True, return_counts=True)
    for size in np.unique(spokes):
        rows = first[spokes == size][:, None] + np.arange(size)  # spokes of each panel, by corner
        if size == 4:
            opposite = np.roll(length[rows], -2, axis=1)
        else:
            unit = vector[rows] / length[rows][:, :, None]
            alignment = np.einsum("pic,pjc->pij", unit, unit)
            opposite = np.take_along_axis(length[rows], alignment.argmin(axis=2), axis=1)
        kb = bend_stiffness_per_length(length[rows] + opposite, g[rows], t[rows])
        if merlin2:
            kb = _merlin2_corners(kb, rows, mesh, pattern)
        per_length[rows] = kb
    return per_length * length


def _merlin2_corners(kb: NDArray, rows: NDArray, mesh: Mesh, pattern: Pattern) -> NDArray:
    """kb (p, m) by corner as MERLIN2 assigns it.

    The corner with the i-th smallest node number gets the value of the i-th listed corner.
    """
    out = np.empty_like(kb)
    for p, spokes in enumerate(rows):
        panel = int(mesh.inner_panel[spokes[0]])
        m = len(pattern.faces[panel])
        listed = (-np.arange(m) if pattern.flipped[panel] else np.arange(m)) % m  # order of input
        rank = np.argsort(np.array(pattern.faces[panel])[listed])
        out[p, listed[rank]] = kb[p, listed]
    return out


def bar_areas(
    mesh: Mesh, pattern: Pattern, sheet: Sheet, merlin2: bool = False, alike: bool = False
) -> tuple[NDArray, dict[tuple[int, int], float]]:
    """Cross-section areas (m2) of the inner bars (nh,), and of the edges by (low, high).

    alike : whether all bars of a panel have equal areas, also in quads with a center.

    The area of a panel with its own modulus is scaled by the ratio of that modulus to the sheet's
    (transformed section), so that E A of an edge is the sum over its panels.
    """
    kinds, kind = sheet.kinds(len(pattern.faces))
    x = mesh.nodes
    inner = np.zeros(len(mesh.inner))
    inner_sum = np.bincount(mesh.inner_panel, lengths(x, mesh.inner), minlength=len(pattern.faces))
    triangle_area = 0.5 * np.linalg.norm(double_areas(x, mesh.triangles), axis=1)
    panel_area = np.bincount(mesh.triangle_panel, triangle_area, len(pattern.faces))
    inner_first = np.searchsorted(mesh.inner_panel, np.arange(len(pattern.faces) + 1))
    creases = set(map(tuple, pattern.creases.tolist()))
    edges: dict[tuple[int, int], float] = {}
    weak: list[int] = []
    for panel, face in enumerate(pattern.faces):
        own = kinds[kind[panel]]
        t, nu = own.thickness, own.poissons_ratio
        stiffer = own.youngs_modulus / sheet.youngs_modulus
        inside = slice(inner_first[panel], inner_first[panel + 1])
        ends = [edge_of(a, b) for a, b in around(face)]
        length = pattern.sides[panel]
        if len(face) == 4 and mesh.centers[panel] >= 0 and not alike:
            if nu <= 0.0:
                raise InputError(
                    f"sheet: poissons_ratio = {nu}: N5B8 quadrilaterals need it above 0 (the area "
                    'of their spokes is proportional to it); use scheme = "n4b5"'
                )
            w, h = 0.5 * (length[0] + length[2]), 0.5 * (length[1] + length[3])
            scale = t / (2.0 * (1.0 - nu**2))
            along = scale * abs(h**2 - nu * w**2) / h
            across = scale * abs(w**2 - nu * h**2) / w
            area = np.array([along, across, along, across])
            inner[inside] = scale * nu * (h**2 + w**2) ** 1.5 / (h * w) * stiffer
            if area.min() < WEAK * t * min(w, h):
                weak.append(panel)
            if merlin2 and all(e in creases for e in ends):
                area = _merlin2_edges(area, ends, pattern, panel)
        else:
            whole = (1.0 - nu) * (length.sum() + inner_sum[panel])
            area = np.full(len(face), 2.0 * panel_area[panel] * t / whole)
            inner[inside] = area[0] * stiffer
        for pair, value in zip(ends, area.tolist(), strict=True):
            edges[pair] = edges.get(pair, 0.0) + value * stiffer
    if weak:
        shown = ", ".join(map(str, weak[:6])) + (", ..." if len(weak) > 6 else "")
        warn(
            f"panel {shown}: two edges get (almost) no bar area, because H^2 is close to nu W^2 "
            "(W, H the lengths of its sides): it shears freely in its plane; use "
            'scheme = "n4b5", or panels of other proportions',
            "theory.md#calibration",
        )
    return inner, edges


def _merlin2_edges(area: NDArray, ends: list, pattern: Pattern, panel: int) -> NDArray:
    """Areas of a quad with four folds as MERLIN2 assigns them.

    The i-th edge in lexicographic order of node numbers gets the area of the i-th listed edge.
    """
    listed = [3, 2, 1, 0] if pattern.flipped[panel] else [0, 1, 2, 3]
    out = np.empty(4)
    out[sorted(range(4), key=lambda k: ends[k])] = area[listed]
    return out


def check_sheet(sheet: Sheet, pattern: Pattern) -> None:
    """Refuse unknown panels, and values too far from 1 to compute with."""
    sheet.check_panels(len(pattern.faces))
    _check_boards(sheet, pattern)
    edges = lengths(pattern.vertices, pattern.edges)
    for kind in sheet.kinds(len(pattern.faces))[0]:
        _check_scale(kind, float(edges.min()), float(edges.max()))


def _check_boards(sheet: Sheet, pattern: Pattern) -> None:
    """Refuse thick panels whose thickness differs from the sheet's."""
    if pattern.boards is None:
        return
    drawn, own = pattern.boards.thickness, sheet.values("thickness", len(pattern.faces))
    other = np.flatnonzero(np.abs(drawn - own) > SAME * own)
    if other.size:
        p = other[0]
        raise InputError(
            f"sheet: thickness = {own[p]:g} m of panel {p}, whose thick pattern was made with "
            f"{drawn[p]:g} m: give both the same (in a case file, hinge_offset does)"
        )


def _check_scale(sheet: Sheet, low: float, high: float) -> None:
    """Refuse a sheet whose stiffness or mass, with edges from low to high (m), is out of range."""
    stretching, mass = sheet.modulus * sheet.thickness, sheet.thickness * high**2
    for what, value in (
        ("stretching stiffness E t (N/m)", stretching),
        ("bending stiffness E t^3 / 12(1 - nu^2) L^2 (N/m)", sheet.bending_modulus / low**2),
        ("bending stiffness E t^3 / 12(1 - nu^2) L^2 (N/m)", sheet.bending_modulus / high**2),
        ("mass rho t L^2 (kg)", mass * (sheet.density or 1.0)),
    ):
        if not 1.0 / STIFFEST <= value <= STIFFEST:
            density = "" if sheet.density is None else f", density = {sheet.density:g} kg/m3"
            raise InputError(
                f"sheet: its {what} is {value:.3g}, out of range: check youngs_modulus = "
                f"{sheet.modulus:g} Pa, thickness = {sheet.thickness:g} m{density} and the "
                f"pattern, whose edges have {low:.3g} to {high:.3g} m"
            )


PerCrease = float | Sequence[float] | Mapping[str, float] | None
Folds = PerCrease | Strip | Mapping[str, float | Strip]


def check_creases(options: Any) -> None:
    """Check the values for creases of a frozen data class of options, and set them in place."""
    for name, check in (("crease_stiffness", folds_given), ("crease_rest", per_crease)):
        object.__setattr__(options, name, check(name, getattr(options, name)))


def per_crease(name: str, value: Any) -> Any:
    """Return values for creases as a number, a tuple, or a new dict by word; None unchanged.

    The number of values and the words are checked later, with the pattern.
    """
    if isinstance(value, Mapping):
        if not value:
            raise InputError(": give a value by assignment or family, as { valley = 0.1 }", name)
        strange = [word for word in value if not isinstance(word, str)]
        if strange:
            raise InputError(f": {show(strange[0])} is no assignment or family of creases", name)
        return {word: number(f"{name}.{word}", value[word]) for word in value}
    value = single(value)
    if isinstance(value, list | tuple | np.ndarray):
        return tuple(numbers(name, value).tolist())
    return None if value is None else number(name, value)


def folds_given(name: str, value: Any) -> Any:
    """Return stiffness of creases as in `per_crease`, with strips among them."""
    if isinstance(value, Strip):
        return value
    if not isinstance(value, Mapping):
        return per_crease(name, value)
    if {*value} & {*arguments(Strip)}:  # in a file
        return read(Strip, name, value)
    strips = {
        word: read(Strip, f"{name}.{word}", own) if isinstance(own, Mapping) else own
        for word, own in value.items()
        if isinstance(own, Mapping | Strip)
    }
    others = {word: own for word, own in value.items() if word not in strips}
    return {**(per_crease(name, others) if others or not strips else {}), **strips}


def fold_stiffness(given: Folds, pattern: Pattern, sheet: Sheet) -> NDArray:
    """Stiffness of whole creases (nf,), N m/rad: calibrated, of strips, or `given` per length."""
    length, name = lengths(pattern.vertices, pattern.creases), "crease_stiffness"
    if given is None:
        return calibrated_folds(length, pattern, sheet)
    if isinstance(given, Strip):
        return given.stiffness(pattern, sheet, name=name) * length
    strips = {}
    if isinstance(given, Mapping):
        strips = {word: own for word, own in given.items() if isinstance(own, Strip)}
        given = {word: 0.0 if isinstance(own, Strip) else own for word, own in given.items()}
    per_length, chosen = _values(name, given, pattern)
    for word, strip in strips.items():
        rows = crease_rows(f"{name}.{word}", word, pattern, is_key=True)
        per_length[rows] = strip.stiffness(pattern, sheet, name=f"{name}.{word}")[rows]
    if (per_length[chosen] < 0.0).any():
        raise InputError("crease_stiffness: must not be negative")
    if chosen.all():
        return per_length * length
    return np.where(chosen, per_length * length, calibrated_folds(length, pattern, sheet))


def fold_rest(
    given: PerCrease, drawn: NDArray, pattern: Pattern, crease: NDArray | None = None
) -> NDArray:
    """Rest dihedrals (rad) of hinge rows with the dihedrals `drawn` (nf,), none of them closed.

    crease : index of each row's crease; by default, row k belongs to crease k.
    """
    crease = np.arange(len(drawn)) if crease is None else crease
    degrees, chosen = _values("crease_rest", given, pattern)
    closed = degrees[chosen & ((degrees <= 0.0) | (degrees >= 360.0))]
    if closed.size:
        raise InputError(
            f"crease_rest = {closed[0]:g}: must lie between 0 and 360 degrees (flat: 180)"
        )
    doubt_degrees("crease_rest", degrees[chosen])
    rest, given_there = np.radians(degrees)[crease], chosen[crease]
    if given_there.all():
        return rest
    shut = (drawn < 1e-9) | (drawn > 2.0 * np.pi - 1e-9) | np.isnan(drawn)
    shut |= np.abs(drawn - pattern.dihedrals[crease]) > np.pi  # closed according to its assignment
    wrong = np.flatnonzero(shut & ~given_there)
    if len(wrong):
        number = crease[wrong[0]]
        low, high = pattern.creases[number]
        raise InputError(
            f"crease {number} (vertices {low}, {high}) is folded flat upon itself: open "
            "the pattern, or give crease_rest and start from an opened one"
        )
    return np.where(given_there, rest, drawn)


def _values(field: str, given: PerCrease, pattern: Pattern) -> tuple[NDArray, NDArray]:
    """Value of each crease (nf,), and a mask of the creases with a given value (nf,)."""
    count = len(pattern.creases)
    if given is None:
        return np.zeros(count), np.zeros(count, bool)
    if not isinstance(given, Mapping):
        array = numbers(field, given)
        if array.ndim > 1 or (array.ndim == 1 and len(array) != count):
            raise InputError(
                f"{field}: {array.size} values for {count} creases: give one, or one for each"
            )
        return np.broadcast_to(array, (count,)).copy(), np.ones(count, bool)
    return crease_values(field, given, pattern)
