"""Laws with memory: a hinge law with parallel branches, whose moments depend on the past.

A hinge turned by d = theta - theta0 from its rest angle has the moment M = k (m(d) + sum of b),
with m the elastic law and b the branches, both per unit stiffness k. A branch depends on d now and
at the last accepted step, on the state of the branch at that step, and on the time since then.
Kernels call all branches through one switch (`branch_switch`). The elastic part has the code of its
own law, so kernels that ignore branches work with the elastic part.
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

VARIABLES = 2  # number of variables in the state of a branch


class Branch(NamedTuple):
    """A branch of the law of n hinges, per unit stiffness.

    For small vibrations of complex angular frequency s about a state at rest, its stiffness is
    relaxed + share s / (s + rate).
    """

    code: int  # code in the switch
    parameters: NDArray  # (n, 4)
    relaxed: float
    share: float | NDArray  # (n,)
    rate: NDArray  # (n,) 1/s
    more: float | NDArray = 0.0  # stiffness that the branch can have besides


class MemoryLaw(HingeLaw):
    """Base of hinge laws with branches: data classes whose field `law` is the elastic part."""

    law: str | HingeLaw
    lookup: ClassVar[Callable[..., HingeLaw]]
    """The function `materials.hinge_law`; the registry sets it, as it knows all laws."""
    formulas: ClassVar[tuple[BranchFormulas, ...]] = ()
    """Formulas of the branches, one for each code."""
    rate_dependent: ClassVar[bool]
    """Whether the moment depends on time, rather than on the path alone."""
    relaxes: ClassVar[bool] = False
    """Whether the moment at a fixed angle relaxes to the moment of the elastic part."""

    @cached_property
    def elastic(self) -> HingeLaw:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Elastic part of the law."""
        law = self.lookup(self.law, "law")
        if isinstance(law, MemoryLaw):
            raise InputError(f" = {law.name!r}: has a memory itself; give another", "law")
        return law

    def agree(self) -> None:
        """Refuse an elastic part that has memory."""
        _ = self.elastic

    @abstractmethod
    def branches(self, stiffness: NDArray, length: NDArray) -> tuple[Branch, ...]:
        """Branches of the law for hinges with stiffnesses (n,), N m/rad, and lengths (n,), m."""

    def lost_slope(self, stiffness: NDArray, length: NDArray) -> NDArray:
        """Slope / k (n,) that yielding or creep takes from the elastic law; see `branches`."""
        return np.zeros(len(stiffness))

    def least_slope(self, rest: NDArray, stiffness: NDArray, length: NDArray) -> NDArray:
        """Least slope that is left after yielding or long times; see `HingeLaw`."""
        elastic = self.elastic.least_slope(rest, stiffness, length)
        return np.maximum(elastic - self.lost_slope(stiffness, length), 0.0)

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
        if not self.elastic.slope(np.pi, np.pi) > 0.0:
            raise InputError(
                f": {self.name} uses shares of the stiffness at rest, and {self.elastic.name!r} "
                'has none there; give law = "linear" or "enhanced"',
                field,
            )
