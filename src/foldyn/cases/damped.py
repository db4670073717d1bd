"""What of a case takes energy out of it: its damping by kinds, and its dashpots."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.cases.damping import CreaseDamping, Damping, ModalDamping, Rayleigh, StrainDamping
from foldyn.cases.dashpots import Dashpot
from foldyn.errors import Faults, InputError
from foldyn.structures.discretized import read_only


class Damped:
    """Damping of a case, which has `structure`, `supports` and `damping`.

    Attributes
    ----------
    rayleigh : Rayleigh
        Its part of the damping, of nothing where there is none.
    modal_damping : ModalDamping or None
        Damping ratios of modes, if there are any.
    crease_damping : ndarray, shape (nf,)
        Damping of each fold, N m s/rad per m of crease.
    strain_damping : float
        Damping of strain rates, s.
    dashpots : tuple of (str, Dashpot)
        Those among the supports, with their places for messages.
    damped : bool
        Whether anything dissipates energy.
    """

    structure: Any
    supports: Sequence[Any]
    damping: Damping | Sequence[Damping]

    @property
    def dampings(self) -> tuple[Damping, ...]:
        """Its kinds of damping."""
        return tuple(self.damping) if isinstance(self.damping, Sequence) else (self.damping,)

    def _check_damping(self, faults: Faults) -> None:
        """Refuse nodes and creases that are not there."""
        for place, dashpot in self.dashpots:
            with faults.collected():
                dashpot.ends(self.structure, place)
        for part in self.dampings:
            if isinstance(part, CreaseDamping):
                with faults.collected():
                    part.per_length(self.structure, "damping")
        if self.strain_damping and self.structure.body.strains() is None:
            with faults.collected():
                raise InputError(
                    "damping: StrainDamping takes bars and hinges, and the panels of this model "
                    "bend as plates; take CreaseDamping, or Rayleigh for what hardly turns"
                )

    @cached_property
    def rayleigh(self) -> Rayleigh:
        """See the class."""
        return next((part for part in self.dampings if isinstance(part, Rayleigh)), Rayleigh())

    @cached_property
    def modal_damping(self) -> ModalDamping | None:
        """See the class."""
        return next((part for part in self.dampings if isinstance(part, ModalDamping)), None)

    @cached_property
    def crease_damping(self) -> NDArray[np.float64]:
        """See the class."""
        parts = [part for part in self.dampings if isinstance(part, CreaseDamping)]
        none = np.zeros(len(self.structure.folds))
        return read_only(sum((part.per_length(self.structure, "damping") for part in parts), none))

    @property
    def strain_damping(self) -> float:
        """See the class."""
        return next((part.beta for part in self.dampings if isinstance(part, StrainDamping)), 0.0)

    @cached_property
    def dashpots(self) -> tuple[tuple[str, Dashpot], ...]:
        """See the class."""
        places = ((f"supports[{i}]", support) for i, support in enumerate(self.supports))
        return tuple(pair for pair in places if isinstance(pair[1], Dashpot))

    @property
    def damped(self) -> bool:
        """See the class."""
        rayleigh = self.rayleigh.alpha > 0.0 or self.rayleigh.beta > 0.0
        modal = self.modal_damping is not None and bool(np.any(self.modal_damping.ratios))
        dashpots = any(dashpot.coefficient > 0.0 for _, dashpot in self.dashpots)
        strain = self.strain_damping > 0.0
        return rayleigh or modal or dashpots or strain or bool(self.crease_damping.any())
