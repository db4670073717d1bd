"""Enhanced linear moment law of folds: linear, but with infinite stiffness as panels meet.

With p = pi/theta1 below theta1 (and, mirrored, p = pi/(2 pi - theta2) above theta2),
M/k = (theta1 - theta0) + tan(p (theta - theta1)/2) / (p/2); linear in between.
Source: Liu and Paulino, Proc. R. Soc. A 473, 2017 (MERLIN).

If the rest angle theta0 lies below theta1 or above theta2, the published law has a moment at rest.
`rest="stress_free"` subtracts that moment and the energy at rest, so that the pattern as drawn is
in equilibrium; `rest="as_published"` keeps both.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from foldyn.arguments import Check
from foldyn.errors import InputError
from foldyn.jit.compiled import inner_scalar, kernel, scalar
from foldyn.materials.formulas import HingeFormulas
from foldyn.materials.law import HingeLaw, columns
from foldyn.values import choice, number, writable

STRESS_FREE, AS_PUBLISHED = 2, 3  # codes of the two laws
TWO_PI = 2.0 * math.pi
HALF_PI = 0.5 * math.pi

# The depth of a fold in its locking range goes from 0 (at theta1 or theta2) to exactly 1 (closed).
# An angle above pi/2, even by rounding, would change the sign of the tangent.


@scalar
def energy(theta, rest, theta1, theta2):
    """Energy / k as published; not zero at rest if rest lies outside theta1 to theta2."""
    if theta < theta1:
        d, r, span = rest - theta1, theta1 - theta, theta1
    elif theta > theta2:
        d, r, span = theta2 - rest, theta - theta2, TWO_PI - theta2
    else:
        return 0.5 * (theta - rest) ** 2
    p = math.pi / span
    return 0.5 * d * d + d * r - 4.0 / (p * p) * math.log(math.cos(HALF_PI * (r / span)))


@scalar
def moment(theta, rest, theta1, theta2):
    """Moment / k as published."""
    if theta < theta1:
        return theta1 - rest - math.tan(HALF_PI * ((theta1 - theta) / theta1)) * theta1 / HALF_PI
    if theta > theta2:
        span = TWO_PI - theta2
        return theta2 - rest + math.tan(HALF_PI * ((theta - theta2) / span)) * span / HALF_PI
    return theta - rest


@scalar
def slope(theta, rest, theta1, theta2):
    """Slope / k: 1 between theta1 and theta2, 1/cos^2 outside."""
    if theta < theta1:
        return 1.0 / math.cos(HALF_PI * ((theta1 - theta) / theta1)) ** 2
    if theta > theta2:
        return 1.0 / math.cos(HALF_PI * ((theta - theta2) / (TWO_PI - theta2))) ** 2
    return 1.0


@scalar
def by_limits(theta, rest, theta1, theta2):
    """Derivatives of the published moment / k with respect to theta1 and theta2."""
    if theta < theta1:
        tangent = math.tan(HALF_PI * ((theta1 - theta) / theta1))
        return 1.0 - (1.0 + tangent * tangent) * theta / theta1 - tangent / HALF_PI, 0.0
    if theta > theta2:
        span = TWO_PI - theta2
        tangent = math.tan(HALF_PI * ((theta - theta2) / span))
        closing = (1.0 + tangent * tangent) * (TWO_PI - theta) / span
        return 0.0, 1.0 - closing - tangent / HALF_PI
    return 0.0, 0.0


@scalar
def energy_by_rest(theta, rest):
    """Derivative of the published energy / k with respect to rest."""
    return rest - theta


@scalar
def moment_by_rest(theta, rest):
    """Derivative of moment / k with respect to rest, with the moment at rest held fixed."""
    return -1.0


@inner_scalar
def relieved_energy(theta, rest, theta1, theta2, moment_at_rest, energy_at_rest):
    """Energy / k of the stress-free law."""
    return energy(theta, rest, theta1, theta2) - moment_at_rest * (theta - rest) - energy_at_rest


@inner_scalar
def relieved_moment(theta, rest, theta1, theta2, moment_at_rest):
    """Moment / k of the stress-free law."""
    return moment(theta, rest, theta1, theta2) - moment_at_rest


@inner_scalar
def relieved_by_parameters(theta, rest, theta1, theta2, moment_at_rest):
    """Derivatives of the stress-free moment / k with respect to theta1, theta2, moment_at_rest."""
    by_first, by_second = by_limits(theta, rest, theta1, theta2)
    return by_first, by_second, -1.0


@inner_scalar
def relieved_energy_by_rest(theta, rest, theta1, theta2):
    """Derivative of the stress-free energy / k with respect to rest, subtracted terms included."""
    return slope(rest, rest, theta1, theta2) * (rest - theta)


@inner_scalar
def relieve(rest, parameters):
    """Set the moment and the energy at rest that the stress-free law subtracts."""
    theta1, theta2 = parameters[0], parameters[1]
    parameters[2] = moment(rest, rest, theta1, theta2)
    parameters[3] = energy(rest, rest, theta1, theta2)


@kernel
def _relieve_each(rest, table):
    for i in range(rest.size):
        relieve(rest[i], table[i])


@dataclass(frozen=True)
class EnhancedLinear(HingeLaw):
    """Linear fold law that locks as the panels meet.

    Parameters
    ----------
    theta1, theta2 : float
        Dihedrals (degrees) between which the law is linear, 0 < theta1 < theta2 < 360.
    rest : {"stress_free", "as_published"}
        Whether the law subtracts its moment at the rest angle (see the module docstring).

    Examples
    --------
    >>> import numpy as np
    >>> law = EnhancedLinear(theta1=45, theta2=315)
    >>> float(law.moment(np.pi / 2, rest=np.pi / 3).round(4))
    0.5236
    """

    theta1: Annotated[float, Check(number, unit="degrees")] = 45.0
    theta2: Annotated[float, Check(number, unit="degrees")] = 315.0
    rest: Annotated[str, Check(choice, known=("stress_free", "as_published"))] = "stress_free"
    name: str = "enhanced"

    formulas = (
        HingeFormulas(
            STRESS_FREE, relieved_energy, relieved_moment, slope, relieved_by_parameters,
            relieved_energy_by_rest, moment_by_rest, relieve,
        ),
        HingeFormulas(
            AS_PUBLISHED, energy, moment, slope, by_limits, energy_by_rest, moment_by_rest
        ),
    )  # fmt: skip

    def agree(self) -> None:
        """Refuse theta1 and theta2 that are not in order."""
        if not 0.0 < self.theta1 < self.theta2 < 360.0:
            raise InputError(
                f"theta1 = {self.theta1}, theta2 = {self.theta2}: need "
                "0 < theta1 < theta2 < 360 (degrees)"
            )

    @property
    def code(self) -> int:
        """Code of the formulas, which depends on whether the moment at rest is subtracted."""
        return AS_PUBLISHED if self.rest == "as_published" else STRESS_FREE

    @property
    def linear_between(self) -> tuple[float, float]:
        """theta1 and theta2 (rad)."""
        return math.radians(self.theta1), math.radians(self.theta2)

    @property
    def closed_at_rest(self) -> bool:
        """Whether a hinge may be closed at rest; the stress-free law would subtract infinity."""
        return self.rest == "as_published"

    def parameters(self, rest: NDArray) -> NDArray:
        """theta1 and theta2 (rad), and the moment and energy at rest to subtract, of each hinge."""
        low, high = self.linear_between
        table = columns(len(rest), low, high)
        if self.code == STRESS_FREE and not ((rest >= low) & (rest <= high)).all():  # else zeros
            _relieve_each(writable(rest), table)
        return table

    def least_slope(self, rest: NDArray, stiffness: NDArray, length: NDArray) -> NDArray:
        """That between theta1 and theta2; see `HingeLaw`."""
        return np.ones(len(rest))

    def reach(self, theta: NDArray, rest: NDArray, parameters: NDArray) -> NDArray:
        """Distance to the nearest of theta1, theta2 and the closed angles; see `HingeLaw`."""
        kinks = (0.0, *self.linear_between, TWO_PI)
        return np.min([np.abs(theta - kink) for kink in kinks], axis=0)
