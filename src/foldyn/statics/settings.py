"""Settings of the solvers, all with defaults that need no change for most structures."""

from __future__ import annotations

from dataclasses import dataclass

from foldyn.errors import InputError
from foldyn.values import number, whole


@dataclass(frozen=True)
class Settings:
    """How equilibria are solved for and how steps are chosen.

    Parameters
    ----------
    tolerance : float
        A state is accepted when the residual is below this fraction of the forces at play and
        the last step below this fraction of the displacements (both; see `statics.tolerance`).
    iterations : int
        Newton iterations after which an attempt is given up and the step is cut.
    target : int
        Iterations per point that the step control aims at: steps shrink above and grow below.
    cuts : int
        Halvings of the first step (of each interval of load factors) after which a path ends.
    largest_turn : float
        Degrees by which a hinge (or, without hinges, a bar) may turn within one step of
        "mgdcm" and "arc_length".
    jump : float
        A step that moves more than this many times as far as its linear prediction has left the
        path (snapped) and is cut.
    stability : bool
        Count the negative eigenvalues of the tangent at every point.
    locate : bool
        Find the limit and bifurcation points between the points of a path ("newton" returns only
        the factors it is given and locates none).
    solver : str
        "auto", or one of `statics.SOLVERS`.
    """

    tolerance: float = 1e-9
    iterations: int = 25
    target: int = 6
    cuts: int = 15
    largest_turn: float = 10.0
    jump: float = 3.0
    stability: bool = True
    locate: bool = True
    solver: str = "auto"

    def __post_init__(self) -> None:
        """Check the values."""
        for name in ("tolerance", "largest_turn", "jump"):
            number(f"settings: {name}", getattr(self, name), above=0.0)
        if not 1e-14 <= self.tolerance <= 1e-2:
            raise InputError(
                f"settings: tolerance = {self.tolerance:g}: give one between 1e-14 and 0.01"
            )
        if self.jump <= 1.0:
            raise InputError(f"settings: jump = {self.jump:g}: give a number above 1")
        for name in ("iterations", "target", "cuts"):
            whole(f"settings: {name}", getattr(self, name), least=1)
        for name in ("stability", "locate"):
            if not isinstance(getattr(self, name), bool):
                raise InputError(f"settings: {name} = {getattr(self, name)!r}: give True or False")
