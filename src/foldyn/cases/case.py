"""The case: what a solver gets."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.cases.damping import Rayleigh
from foldyn.cases.histories import History, as_history
from foldyn.cases.loads import Force
from foldyn.cases.selection import resolve_nodes
from foldyn.cases.supports import Fix
from foldyn.cases.values import show
from foldyn.errors import FoldynWarning, InputError

AXES = "xyz"


@dataclass(frozen=True, eq=False)
class Case:
    """A structure with supports, loads and damping.

    Parameters
    ----------
    structure : Structure
        The discretized pattern.
    supports : sequence of Fix
        Nodes held at rest; none by default (free motion is legal in dynamics).
    loads : sequence of Force
        Forces; none by default.
    damping : Rayleigh
        Damping; none by default.

    Attributes
    ----------
    fixed : ndarray of bool, shape (n, 3)
        True where a node is held along an axis.
    free_dofs, supported_dofs : ndarray of int64
        Numbers 3 * node + axis of the free and of the held ones, increasing.
    load_terms : tuple of (ndarray of shape (n, 3), History)
        Forces (N) on all nodes with their history; loads with equal histories are one term.
        Forces on held nodes are kept: the reactions carry them.

    Raises
    ------
    InputError
        A node is out of range, or a load acts on held axes only.

    Warns
    -----
    FoldynWarning
        A load acts on held axes in part.
    """

    structure: Any
    supports: Sequence[Fix] = ()
    loads: Sequence[Force] = ()
    damping: Rayleigh = field(default_factory=Rayleigh)

    def __post_init__(self) -> None:
        """Check the arguments."""
        for name, kind in (("supports", Fix), ("loads", Force)):
            object.__setattr__(self, name, _tuple_of(name, kind, getattr(self, name)))
        if not isinstance(self.damping, Rayleigh):
            raise InputError(
                f"damping = {show(self.damping)}: must be Rayleigh(alpha=..., beta=...)"
            )
        _ = self.fixed  # checks the supports' nodes
        for i, load in enumerate(self.loads):
            self._check_load(f"loads[{i}]", load)

    @cached_property
    def fixed(self) -> NDArray[np.bool_]:
        """Whether each node is held along each axis, shape (n, 3)."""
        mask = np.zeros((len(self.structure.nodes), 3), dtype=bool)
        for i, support in enumerate(self.supports):
            nodes = resolve_nodes(self.structure, support.nodes, f"supports[{i}].nodes")
            for axis in support.axes:
                mask[nodes, AXES.index(axis)] = True
        mask.flags.writeable = False
        return mask

    @cached_property
    def free_dofs(self) -> NDArray[np.int64]:
        """Numbers 3 * node + axis that are free, increasing."""
        return np.flatnonzero(~self.fixed.ravel()).astype(np.int64)

    @cached_property
    def supported_dofs(self) -> NDArray[np.int64]:
        """Numbers 3 * node + axis that are held, increasing."""
        return np.flatnonzero(self.fixed.ravel()).astype(np.int64)

    @cached_property
    def load_terms(self) -> tuple[tuple[NDArray[np.float64], History], ...]:
        """Forces (N) on all nodes, shape (n, 3), each with its history."""
        terms: list[tuple[NDArray[np.float64], History]] = []
        for i, load in enumerate(self.loads):
            nodes = resolve_nodes(self.structure, load.nodes, f"loads[{i}].nodes")
            history = as_history(load.history)
            forces = next((forces for forces, other in terms if other == history), None)
            if forces is None:
                forces = np.zeros((len(self.structure.nodes), 3))
                terms.append((forces, history))
            forces[nodes] += load.vector
        for forces, _ in terms:
            forces.flags.writeable = False
        return tuple(terms)

    @cached_property
    def loaded_nodes(self) -> NDArray[np.int64]:
        """Nodes on which a load acts, increasing."""
        chosen = [
            resolve_nodes(self.structure, load.nodes, f"loads[{i}].nodes")
            for i, load in enumerate(self.loads)
        ]
        return np.unique(np.concatenate(chosen)) if chosen else np.zeros(0, dtype=np.int64)

    def _check_load(self, place: str, load: Force) -> None:
        nodes = resolve_nodes(self.structure, load.nodes, f"{place}.nodes")
        acts = np.flatnonzero(load.vector)
        held = self.fixed[np.ix_(nodes, acts)]
        if not held.any():
            return
        what = ", ".join(
            f"{node} ({''.join(AXES[a] for a in acts[row])})"
            for node, row in zip(nodes, held, strict=True)
            if row.any()
        )
        what = what if len(what) < 80 else what[:76] + " ..."
        if held.all():
            raise InputError(
                f"{place}: the force {show(load.vector)} acts only where supports hold its nodes: "
                f"{what}; load other nodes or axes, or free these"
            )
        warnings.warn(
            f"{place}: the force {show(load.vector)} acts in part where supports hold its nodes: "
            f"{what}; that part goes into the reactions only",
            FoldynWarning,
            stacklevel=4,
        )


def _tuple_of(name: str, kind: type, given: Any) -> tuple:
    if isinstance(given, str) or not isinstance(given, Sequence):
        raise InputError(f"{name} = {show(given)}: must be a list of {kind.__name__}")
    for i, item in enumerate(given):
        if not isinstance(item, kind):
            raise InputError(f"{name}[{i}] = {show(item)}: must be a {kind.__name__}")
    return tuple(given)
