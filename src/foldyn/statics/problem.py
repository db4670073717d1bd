"""What the solvers of equilibrium take: a small protocol on flat vectors of dofs.

With u (m,) all dofs and a load factor f, a path is the set of solutions of

    residual(u, f) = internal force - external force = 0  on the free dofs,
    u = prescribed(f)                                     on the held ones,

so a von Mises truss, a sheet of origami and a shell all look the same from here.
"""

from __future__ import annotations

from typing import Any, Protocol

from numpy.typing import NDArray


class Problem(Protocol):
    """Equilibrium of m dofs along a load factor.

    Attributes
    ----------
    free, held : ndarray of int
        Dofs that are solved for, and the others; together all, each increasing.
    force_rounding : float
        Norm (N) of the residual's rounding errors on the free dofs.
    length : float
        Norm (m) of the dofs' rest positions: the rounding of displacements is measured by it.
    """

    free: NDArray
    held: NDArray
    force_rounding: float
    length: float

    def prescribed(self, factor: float) -> NDArray:
        """Values of the held dofs; linear in the factor."""
        ...

    def residual(self, u: NDArray, factor: float) -> NDArray:
        """Internal minus external force (m,), N; on held dofs the force of their supports."""
        ...

    def tangent(self, u: NDArray, factor: float, before: NDArray | None = None) -> Any:
        """Symmetric sparse (m, m) derivative of the residual, slopes floored where they vanish.

        Only for steps and for the count of negative eigenvalues; the residual never sees a floor.
        With `before`, the state from which the last step came, it may be another matrix that
        serves the next step better; without, it is the derivative.
        """
        ...

    def rate(self, u: NDArray, factor: float) -> NDArray:
        """Derivative (m,) of the residual with respect to the factor at fixed u."""
        ...

    def reference(self, u: NDArray, factor: float) -> float:
        """Force (N) against which residuals are judged, beside those of the supports."""
        ...

    def turn(self, u: NDArray, v: NDArray) -> float:
        """Largest turn (rad) of a part of the structure from u to v; inf if parts collide."""
        ...
