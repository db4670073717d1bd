"""Modes of a model beside those of a shell."""

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

LEAST = 0.5  # MAC of a partner
SPARE = 10  # modes of a model, beyond those that are compared, among which partners are sought


class Shown(Protocol):
    """Modes of a shell."""

    @property
    def frequency(self) -> NDArray:
        """Increasing, Hz."""
        ...

    def at(self, nodes: NDArray) -> tuple[NDArray, NDArray]:
        """Which of points (m, 3) have shapes (j,), and these (k, j, 3)."""
        ...


class Matched(NamedTuple):
    """What a model has in place of each mode of a shell.

    Attributes
    ----------
    frequency : (k,)
        Of the partner, Hz; nan where no mode has a MAC of 0.5 or more: the mode is lost.
    error : (k,)
        Its relative error; nan likewise.
    mac : (k,)
        Of the partner, or of what is nearest to one.
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
        How many modes of the shell.
    case, found : Case, xarray.Dataset
        The model and its modes, `SPARE` more of them. Shapes are compared at its nodes, with
        internal amplitudes also between them, as far as these are nodes of the shell's mesh.
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

    The nodes, with weights that are the same for all mass rules; with internal amplitudes also
    points between them, which weigh together as much.
    """
    structure = case.structure
    even = replace(structure, options=replace(structure.options, mass="mixed_voronoi"))
    weights = with_structure(case, even).nodal_mass
    if "between_shape" not in found:
        return structure.nodes, weights
    between = found["between_position"].values
    more = np.full(len(between), weights.sum() / len(between))
    return np.concatenate([structure.nodes, between]), np.concatenate([weights, more])
