"""`margins`: how far the stresses of a result stay below what the sheet and its creases bear."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import xarray
from numpy.typing import ArrayLike, NDArray

from foldyn.cases import Case, Temperature
from foldyn.errors import InputError
from foldyn.linear.stresses import ALONG, stresses
from foldyn.patterns import Pattern
from foldyn.patterns.crease_data import crease_values
from foldyn.results import case_of
from foldyn.results.dataset import result_dataset
from foldyn.results.quantities import MARGINS, variables
from foldyn.strength.plies import CRITERIA, ply_factors
from foldyn.structures.material_axes import material_axes
from foldyn.values import choice, number, numbers, show

LARGEST = {"random": "rms", "spectrum": "peak"}  # results that hold one value for all times
MOMENTS = {"load_factor": ", load factor {:.6g}", "time": ", t = {:.6g} s"}
WORDS = {"center": "its center", "edge": "the middle of its edge {}", "corner": "its corner {}"}


def margins(
    result: xarray.Dataset,
    *,
    strength: float | None = None,
    crease_strength: float | Mapping[str, float] | ArrayLike | None = None,
    factor_of_safety: float = 1.0,
    sigmas: float = 3.0,
    criterion: str = "tsai_wu",
) -> xarray.Dataset:
    """Least margins of safety of panels and creases over all states of a result.

    The margin is strength / (factor of safety x stress) - 1: below 0, a panel or crease fails. In
    panels the von Mises stress counts, at both faces, or the stresses of plies that have a strength
    (`Ply.strength`), by their criterion; in creases the moment per length.

    Parameters
    ----------
    result : xarray.Dataset
        A path or a motion; a result of `stresses` of one; or a response to a random base or a
        shock with stresses.
    strength : float, optional
        Largest von Mises stress of all panels, Pa; by default that of the sheet
        (`Sheet.strength`).
    crease_strength : float, mapping of str to float, or sequence of float, optional
        Largest moment per length, N, of all creases, by name ("valley", a family), or of each one.
        Without it, creases have no margin.
    factor_of_safety : float
    sigmas : float
        For random responses: stresses are this number times their root mean square.
    criterion : {"tsai_wu", "maximum_stress"}
        When a ply fails (Tsai and Wu, J. Compos. Mater. 5, 1971, or by its largest component).

    Returns
    -------
    xarray.Dataset
        `panel_margin` (panel), with `panel_point`, the point (as in `stresses`) where it is least,
        and `panel_state`, the load factor or time (nan in random responses and shocks);
        `crease_margin` (crease) and `crease_state`. A margin is inf without stress, and nan without
        a strength. Attributes: `least_margin`, and in words `least_where`.

    Raises
    ------
    InputError
        No strength at all; stresses per unit (of modes and frequency responses), which have none.

    Examples
    --------
    >>> import foldyn as fd
    >>> pattern = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=60)
    >>> sheet = fd.Sheet(1e9, 0.3, thickness=0.01, density=1000.0, strength=1e6)
    >>> held = [fd.Fix([4, 5], "xyz"), fd.Fix([0, 1], "z")]
    >>> push = fd.Force([0, 1], (0.1, 0.0, 0.0))
    >>> path = fd.trace(fd.Case(fd.superelements(pattern, sheet), held, [push]), steps=1)
    >>> fd.margins(path, factor_of_safety=1.5).attrs["least_margin"] > 0.0
    True
    """
    safety = number("factor_of_safety", factor_of_safety, above=0.0)
    criterion = choice("criterion", criterion, CRITERIA)
    case = case_of(result)
    pattern, sheet = case.structure.pattern, case.structure.sheet
    found, when, moment = _stressed(result, number("sigmas", sigmas, above=0.0))
    bears = sheet.values("strength", len(pattern.faces))
    if strength is not None:
        bears = np.full(len(bears), number("strength", strength, above=0.0, unit="Pa"))
    values: dict[str, NDArray] = {}
    words: list[tuple[float, str]] = []
    factor = _factors(found, bears, case if strength is None else None, criterion)
    if not np.isnan(factor).all():
        values |= _panels(found, factor / safety - 1.0, when)
        p = int(np.nan_to_num(values["panel_margin"], nan=np.inf).argmin())
        where = place_in(found, values["panel_point"][p]) + moment(float(values["panel_state"][p]))
        words.append((values["panel_margin"][p], where))
    creases = _crease_strengths(crease_strength, pattern)
    if creases is not None and len(creases):
        with np.errstate(divide="ignore"):
            margin = creases / safety / np.abs(found["crease_moment"].values) - 1.0
        at = np.nan_to_num(margin, nan=np.inf).argmin(axis=0)
        values["crease_margin"], values["crease_state"] = margin.min(axis=0), when[at]
        k = int(np.nan_to_num(values["crease_margin"], nan=np.inf).argmin())
        words.append((values["crease_margin"][k], f"crease {k}{moment(float(when[at[k]]))}"))
    if not words:
        reason = ": the sheet has none; give Sheet(strength=...), or strength and crease_strength"
        if strength is not None or sheet.has_strength:
            reason = ": the panels of this model have no stresses; give crease_strength as well"
        raise InputError(reason, "strength")
    least, where = min(words)
    facts = {"factor_of_safety": safety, "least_margin": least, "least_where": where}
    return result_dataset("margins", case, variables(MARGINS, (), values), {}, facts)


def _stressed(
    result: xarray.Dataset, sigmas: float
) -> tuple[xarray.Dataset, NDArray, Callable[[float], str]]:
    """Stresses along states, where these are (s,), and words for such a place."""
    if result.attrs["foldyn_result"] in LARGEST:
        kind = LARGEST[result.attrs["foldyn_result"]]
        if f"crease_moment_{kind}" not in result:
            raise InputError(
                ": this response has no stresses; compute it with stresses = True", "result"
            )
        names = {f"{name}_{kind}": name for name in ("von_mises", "crease_moment")}
        kept = [name for name in names if name in result]
        found = result[kept].rename({name: names[name] for name in kept})
        found = sigmas * found if kind == "rms" else found
        return found.expand_dims("state"), np.array([np.nan]), lambda _: ""
    found = result if result.attrs["foldyn_result"] == "stresses" else stresses(result)
    first, name, _ = ALONG[found.attrs["of"]]
    if name not in MOMENTS:
        raise InputError(
            f": stresses of {found.attrs['of']} are per unit, and have no margin; give a path, a "
            "motion or a random response",
            "result",
        )
    if first not in found.dims:  # of one state
        found = found.expand_dims(first).assign_coords({name: (first, [float(found[name])])})
    return found, found[name].values, MOMENTS[name].format


def place_in(found: xarray.Dataset, point: Any) -> str:
    """Where a point of stresses is, in words."""
    place = WORDS[str(found["point_place"].values[point])]
    number_ = found["point_number"].values[point]
    return f"panel {found['point_panel'].values[point]} at {place.format(number_)}"


def _factors(
    found: xarray.Dataset, bears: NDArray, case: Case | None, criterion: str
) -> NDArray[np.float64]:
    """Factors (s, p) by which stresses at points may grow; nan where no strength is known.

    bears : (np,) von Mises stress that panels bear, Pa.
    case : whose plies have strengths, or None.
    """
    if "von_mises" not in found:
        return np.zeros(0)
    panel = found["point_panel"].values
    with np.errstate(divide="ignore"):
        factor = (bears[panel][:, None] / found["von_mises"].values).min(axis=2)
    if case is None:
        return factor
    sheet = case.structure.sheet
    kinds, kind = sheet.kinds(len(bears))
    for number_of, own in enumerate(kinds):
        points = np.flatnonzero(kind[panel] == number_of)
        if not any(ply.strength for ply in own.plies or ()) or not len(points):
            continue
        if "membrane_force" not in found:
            raise InputError(
                ": strengths of plies need stresses with signs, and this response has none; give "
                "strength, of von Mises stresses, instead",
                "result",
            )
        expansions = [heat.expansion for _, heat in case.loads_of(Temperature)]
        if not all(isinstance(one, float | None) for one in expansions):
            raise InputError(
                ": plies that expand by different amounts press on each other, which margins leave "
                "out; give strength, of von Mises stresses, instead",
                "result",
            )
        fibers = material_axes(case.structure.pattern, sheet)[panel[points]]  # type: ignore[index]
        x, y = np.einsum("pai,pi->ap", found["panel_axes"].values[panel[points]], fibers)
        force = found["membrane_force"].values[:, points]
        moment = found["bending_moment"].values[:, points]
        factor[:, points] = ply_factors(own, force, moment, np.arctan2(y, x), criterion)
    return factor


def _panels(found: xarray.Dataset, margin: NDArray, when: NDArray) -> dict[str, NDArray]:
    """Least margins of panels, from those of points (s, p), and where they are."""
    panel = found["point_panel"].values
    at = np.nan_to_num(margin, nan=np.inf).argmin(axis=0)  # of each point
    least = margin[at, np.arange(len(panel))]
    order = np.lexsort((np.nan_to_num(least, nan=np.inf), panel))
    point = order[np.searchsorted(panel[order], np.arange(panel.max() + 1))]
    return {"panel_margin": least[point], "panel_point": point, "panel_state": when[at[point]]}


def _crease_strengths(given: Any, pattern: Pattern) -> NDArray[np.float64] | None:
    """Strength of each crease (nf,), N, nan where it has none; None if none is given."""
    count, field = len(pattern.creases), "crease_strength"
    if given is None:
        return None
    if isinstance(given, Mapping):
        checked = {
            word: number(f"crease_strength.{word}", value, above=0.0, unit="N")
            for word, value in given.items()
        }
        values, chosen = crease_values("crease_strength", checked, pattern)
        if not chosen.any():
            raise InputError(": names no crease; give a number (N), or leave it out", field)
        return np.where(chosen, values, np.nan)
    listed = np.asarray(numbers("crease_strength", given), float)
    if listed.shape not in ((), (1,), (count,)) or not (listed > 0.0).all():
        raise InputError(
            f" = {show(given)}: give one number (N) above 0, one for each of the {count} creases, "
            "or numbers by name",
            "crease_strength",
        )
    return np.broadcast_to(listed, (count,)).copy()
