"""Gradients of functions of a frequency response.

At an angular frequency w the response x satisfies Z x = f, Z = K + i w (alpha M + beta K0) - w^2 M,
which is symmetric. With the derivatives s of a real quantity by the response, dJ = Re(s' dx), and
the solution of Z z = s,

    dJ = Re(z' (df - dZ x)):

products as in `gradients.linearized`, of real and imaginary parts. K and K0 also depend on the
state in equilibrium, as for modes.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from foldyn.cases import Case, Rayleigh, State
from foldyn.cases.directions import AXES
from foldyn.errors import FoldynWarning, InputError
from foldyn.gradients.linearized import Products, refuse
from foldyn.gradients.parameters import Gradient, numbers_of
from foldyn.linear.excitation import drive_of, drive_terms
from foldyn.linear.frequency_domain import dynamic_stiffness
from foldyn.linear.frf import frf, quantity_of
from foldyn.linear.linearized import linearize
from foldyn.mechanics.pullback import Arrays

Complex = NDArray[np.complex128]


class FrfGradient:
    """A frequency response of a case, with gradients of functions of it.

    Parameters
    ----------
    case : Case
    arguments : mapping
        Arguments of `fd.frf`.

    Attributes
    ----------
    result : xarray.Dataset
        As from `fd.frf`.
    """

    def __init__(self, case: Case, arguments: Mapping[str, Any]) -> None:
        given = {"method": "direct", **arguments}
        _check_method(given)
        _check_damping(case)
        self.case, self.result = case, frf(case, **given)
        state = given.get("state")
        equilibrium = state == "equilibrium"
        if equilibrium:
            state = State(self.result["displacement"].transpose("node", "axis").values)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FoldynWarning)  # `frf` has warned already
            self._linear = linearize(
                case, state, secant=given.get("secant"), load_factor=given.get("load_factor", 1.0),
                internal=given.get("internal", 0),
            )  # fmt: skip
            self._drive = drive_of(case, given["drive"], given.get("amplitude", 1.0))
        refuse(self._linear, "frequency responses")
        self._axis = None if self._drive.axis is None else AXES.index(self._drive.axis)
        if self._axis is not None and self._linear.ground[:, self._axis].any():
            raise InputError(
                "there are no gradients of transmissibilities if springs are attached to the "
                "ground, not the base; attach their ends to fixed nodes"
            )
        self._products = Products(self._linear, equilibrium)

    def numbers(self, case: Case) -> Arrays:
        """Numbers of a case with respect to which gradients are taken."""
        return numbers_of(case)

    def backward(self, seeds: Mapping[str, NDArray]) -> Gradient:
        """Gradient with respect to the numbers of the case.

        seeds : complex derivatives s of the quantity by the response: it changes by Re(s' dx).
        """
        known = quantity_of(self.result)
        if unknown := [name for name in seeds if name != known]:
            raise InputError(
                f"there are no derivatives through {', '.join(unknown)} of this frequency "
                f"response, but through {known}"
            )
        total = self._products.nothing()
        state, reference = np.zeros((2, len(self._products.q)))
        by_response = np.asarray(seeds[known], np.complex128)
        for k in np.flatnonzero(by_response.any(axis=(1, 2))):
            frequency = float(self.result["frequency"].values[k])
            self._add(frequency, by_response[k].ravel(), total, state, reference)
        self._products.add_state(state, total)
        self._reference.add_state(reference, total)
        return total

    def _add(
        self, frequency: float, by: Complex, total: dict[str, NDArray], state: NDArray,
        reference: NDArray,
    ) -> None:  # fmt: skip
        """Add the part of one frequency (Hz) to `total` and to the derivatives by the states (m,).

        by : derivatives (3n,) by the response; `state` and `reference` are the states of K and K0.
        """
        linear, rayleigh = self._linear, self.case.rayleigh
        omega = 2.0 * np.pi * frequency
        factors = splu(dynamic_stiffness(linear, omega))
        terms = drive_terms(linear, self._drive)
        x = factors.solve(np.sum([term.shape * term.factor(omega) for term in terms], axis=0) + 0j)
        z = factors.solve(linear.projected(by.real) + 1j * linear.projected(by.imag))
        if not np.isfinite(x).all():
            raise InputError(
                f"there is no response at {frequency:g} Hz: give the case damping, as "
                "Rayleigh(alpha=...), or take other frequencies"
            )
        damped, mass = 1j * omega * rayleigh.beta * z, (1j * omega * rayleigh.alpha - omega**2) * z
        state += self._add_products(self._products, -z, x, total)
        reference += self._add_products(self._reference, -damped, x, total)
        self._add_inertia(-mass, x, total)
        total["alpha"] -= (1j * omega * z @ (linear.mass @ x)).real
        total["beta"] -= (1j * omega * z @ (self._stiffness @ x)).real
        if self._axis is not None:
            moved = np.zeros(self.case.structure.nodes.shape)
            moved[:, self._axis] = 1.0
            pushed = (omega**2 - 1j * omega * rayleigh.alpha) * z
            self._products.add_mass(pushed.real, moved, 1.0, total)
            total["alpha"] -= (1j * omega * z @ linear.inertia[:, self._axis]).real

    def _add_products(
        self, products: Products, z: Complex, x: Complex, total: dict[str, NDArray]
    ) -> NDArray:
        """Add the gradient of Re(z' K x), z and x complex; returns the part by the dofs (m,)."""
        real = products.add_stiffness(z.real, x.real, 1.0, total)
        return real + products.add_stiffness(z.imag, x.imag, -1.0, total)

    def _add_inertia(self, z: Complex, x: Complex, total: dict[str, NDArray]) -> None:
        """Add the gradient of Re(z' M x)."""
        self._products.add_mass(z.real, x.real, 1.0, total)
        self._products.add_mass(z.imag, x.imag, -1.0, total)

    @cached_property
    def _reference(self) -> Products:
        """Products with K0, for the stiffness-proportional damping: at rest, or in the state."""
        if self.case.rayleigh.state != "rest" or not self._linear.displacement.any():
            return self._products
        return Products(self._linear, False, np.zeros_like(self._linear.displacement))

    @cached_property
    def _stiffness(self) -> sparse.csr_array:
        """K0 (nf, nf)."""
        tangent = self.case.constraints.matrix(self.case.body.tangent(self._reference.q))
        free = self._linear.free
        return sparse.csr_array(sparse.csr_array(tangent)[free][:, free])


def _check_method(given: Mapping[str, Any]) -> None:
    """Refuse methods whose response does not include all modes."""
    method, count = given["method"], given.get("count")
    if method not in ("direct", "modal") or count is not None:
        what = f"{method!r} with count = {count!r}" if method == "modal" else f"{method!r}"
        raise InputError(
            f" = {what}: there are gradients of the direct method alone, and of modal with all "
            "modes; choose direct",
            "method",
        )


def _check_damping(case: Case) -> None:
    """Refuse dampers other than alpha and beta."""
    plain = all(isinstance(part, Rayleigh) for part in case.dampings)
    if not plain or case.dashpots or case.crease_damping.any():
        raise InputError(
            "there are gradients of frequency responses with alpha and beta alone: damping ratios "
            "of modes change with the modes; give Rayleigh.from_ratios, leave out other dampers, "
            "or vary the parameters by fd.sweep"
        )
