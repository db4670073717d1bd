"""Modes of a model beside those of a shell."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import xarray
from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.linear.pairing import pairs
from foldyn.linear.reference import Reference, elastic
from foldyn.linear.shell_of import with_structure

LEAST = 0.5  # MAC of a partner
SPARE = 10  # modes of a model, beyond those that are compared, among which partners are sought


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


def matched(true: Reference, count: int, case: Case, found: xarray.Dataset) -> Matched:
    """Pair the first modes of a shell with those of a model.

    Parameters
    ----------
    true : Reference
    count : int
        How many modes of the shell.
    case, found : Case, xarray.Dataset
        The model and its modes, `SPARE` more of them. Shapes are compared at its nodes as far as
        they are nodes of the shell's mesh.
    """
    seen, shape = true.at(case.structure.nodes)
    wanted = true.frequency[:count]
    frequency, own = elastic(found, count + SPARE)
    partner, mac = np.full(len(wanted), np.nan), np.zeros(len(wanted))
    if not len(frequency):
        return Matched(partner, partner, mac)
    for pair in pairs(wanted, shape[:count], frequency, own[:, seen], _weights(case)[seen]):
        mac[pair.first] = pair.mac
        if pair.mac >= LEAST:
            partner[pair.first] = frequency[pair.second]
    return Matched(partner, partner / wanted - 1.0, mac)


def _weights(case: Case) -> NDArray:
    """Weights (n,) of the nodes in the MAC, the same for all mass rules."""
    structure = case.structure
    even = replace(structure, options=replace(structure.options, mass="mixed_voronoi"))
    return with_structure(case, even).nodal_mass
