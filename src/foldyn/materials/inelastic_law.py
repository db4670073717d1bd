"""Laws with memory: a hinge law with parallel branches whose moments depend on the past.

A hinge turned by d = theta - theta0 from its rest angle has the moment M = k (m(d) + sum of b),
with m the elastic law and b the branches per unit stiffness k. A branch is a function of d, of d at
the last accepted step, of the state of the branch at that step, and of the time since then.
Kernels call all branches through one switch (`branch_switch`); the elastic part has the code of its
own law: code that ignores branches works with the elastic part.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from functools import cached_property
from operator import attrgetter
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.materials.formulas import BranchFormulas
from foldyn.materials.law import HingeLaw

VARIABLES = 2  # of the state of a branch


class Branch(NamedTuple):
    """A branch of n hinges, per unit stiffness.

    Small vibrations of complex angular frequency s about a state at rest see the stiffness
    relaxed + share s / (s + rate).
    """

    code: int  # of the switch
    parameters: NDArray  # (n, 4)
    relaxed: float
    share: float | NDArray  # (n,)
    rate: NDArray  # (n,) 1/s


class MemoryLaw(HingeLaw):
    """A hinge law with branches: the base of data classes with a field `law`, its elastic part."""

    law: str | HingeLaw
    lookup: ClassVar[Callable[..., HingeLaw]]
    """`materials.hinge_law`, which the registry sets, as it knows these laws."""
    formulas: ClassVar[tuple[BranchFormulas, ...]] = ()
    """Formulas of its branches, one for each code."""
    rate_dependent: ClassVar[bool]
    """Whether its moment depends on time, not on the path alone."""
    relaxes: ClassVar[bool] = False
    """Whether its moment at a held angle relaxes to the moment of the elastic part."""

    @cached_property
    def elastic(self) -> HingeLaw:
        """Its elastic part."""
        law = self.lookup(self.law, "law")
        if isinstance(law, MemoryLaw):
            raise InputError(f" = {law.name!r}: has a memory itself; give another", "law")
        return law

    def agree(self) -> None:
        """Refuse an elastic part that has a memory itself."""
        _ = self.elastic

    @abstractmethod
    def branches(self, stiffness: NDArray, length: NDArray) -> tuple[Branch, ...]:
        """Its branches for hinges with stiffnesses (n,), N m/rad, and lengths (n,), m."""

    code: Any = property(attrgetter("elastic.code"))
    addresses: Any = property(attrgetter("elastic.addresses"))
    linear_between: Any = property(attrgetter("elastic.linear_between"))
    follows_rest: Any = property(attrgetter("elastic.follows_rest"))
    closed_at_rest: Any = property(attrgetter("elastic.closed_at_rest"))

    def parameters(self, rest: NDArray) -> NDArray:
        """Parameters of the elastic part."""
        return self.elastic.parameters(rest)

    def check(self, field: str) -> None:
        """Refuse an elastic part without stiffness at rest."""
        self.elastic.check("fold_law")
        stiff = self.elastic.slope(np.pi, np.pi)
        if not stiff > 0.0:
            raise InputError(
                f": {self.name} takes shares of the stiffness at rest, and {self.elastic.name!r} "
                'has none there; give law = "linear" or "enhanced"',
                field,
            )


def memory_of(law: Any) -> MemoryLaw | None:
    """The law, if it has a memory."""
    return law if isinstance(law, MemoryLaw) else None
