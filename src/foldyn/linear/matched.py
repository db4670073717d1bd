"""Modes of a model, paired with the modes of a shell."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple, Protocol

import numpy as np
import xarray
from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.linear.pairing import pairs
from foldyn.linear.reference import elastic
from foldyn.linear.shell_of import with_structure

LEAST = 0.5  # least MAC of a partner
SPARE = 10  # extra modes of a model among which partners are sought


class Shown(Protocol):
    """Modes of a shell."""

    @property
    def frequency(self) -> NDArray:
        """Increasing, Hz."""
        ...

    def at(self, nodes: NDArray) -> tuple[NDArray, NDArray]:
        """Which points (m, 3) have shapes (j,), and the shapes (k, j, 3)."""
        ...


class Matched(NamedTuple):
    """The counterpart in a model of each mode of a shell.

    Attributes
    ----------
    frequency : (k,)
        Frequency of the partner, Hz; nan if the mode is lost, i.e. no MAC is 0.5 or more.
    error : (k,)
        Relative error of this frequency; nan likewise.
    mac : (k,)
        MAC of the partner, or of the best candidate.
    """

    frequency: NDArray
    error: NDArray
    mac: NDArray


def matched(true: Shown, count: int, case: Case, found: xarray.Dataset) -> Matched:
    """Pair the first modes of a shell with those of a model.

    Parameters
    ----------
    true : Shown
        Such as a `Reference`.
    count : int
        Number of modes of the shell.
    case, found : Case, xarray.Dataset
        The model, and its modes, `SPARE` more than `count`. Shapes are compared at its nodes, and
        with internal amplitudes also between them, if these are nodes of the shell's mesh.
    """
    points, weights = _points(case, found)
    seen, shape = true.at(points)
    wanted = true.frequency[:count]
    frequency, own = elastic(found, count + SPARE)
    if "between_shape" in found:
        own = np.concatenate([own, elastic(found, count + SPARE, "between_shape")[1]], axis=1)
    partner, mac = np.full(len(wanted), np.nan), np.zeros(len(wanted))
    for pair in pairs(wanted, shape[:count], frequency, own[:, seen], weights[seen]):
        mac[pair.first] = pair.mac
        if pair.mac >= LEAST:
            partner[pair.first] = frequency[pair.second]
    return Matched(partner, partner / wanted - 1.0, mac)


def _points(case: Case, found: xarray.Dataset) -> tuple[NDArray, NDArray]:
    """Points (p, 3) where modes are compared, and their weights (p,) in the MAC.

    The nodes, with weights equal for all mass rules; with internal amplitudes also points between
    them, with the same total weight.
    """
    structure = case.structure
    even = replace(structure, options=replace(structure.options, mass="mixed_voronoi"))
    weights = with_structure(case, even).nodal_mass
    if "between_shape" not in found:
        return structure.nodes, weights
    between = found["between_position"].values
    more = np.full(len(between), weights.sum() / len(between))
    return np.concatenate([structure.nodes, between]), np.concatenate([weights, more])
