"""Gradients of functions of modes, such as natural frequencies, and of frequency responses.

With phi' M phi = 1, the change of an eigenvalue is d lambda = phi' (dK - lambda dM) phi (Nelson,
AIAA Journal 14, 1976); such products are computed in `gradients.linearized`.

The change d phi of a shape satisfies (K - lambda M) d phi = -(dK - lambda dM - d lambda M) phi and
phi' M d phi = -phi' dM phi / 2. Let s be the derivatives of a quantity with respect to the shape,
and z, c the solution of (K - lambda M) z + c M phi = s, phi' M z = 0. Then

    s' d phi = -z' (dK - lambda dM) phi - c/2 phi' dM phi.

At an angular frequency w a response x satisfies Z x = f, with the symmetric matrix
Z = K + i w (alpha M + beta K0) - w^2 M. Let s be the derivatives of a real quantity J with respect
to the response, dJ = Re(s' dx), and z the solution of Z z = s. Then

    dJ = Re(z' (df - dZ x)),

computed from products of real and imaginary parts.

K and K0 also depend on the dofs that are in balance (in an equilibrium all dofs, about rest only
massless dofs). Through these dofs, the change of the quantity has the further part -mu' dR, where R
is the residual on these dofs and K mu equals the derivatives of the quantity with respect to them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from copy import copy
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from foldyn.cases import Case, Rayleigh, State
from foldyn.cases.directions import AXES
from foldyn.errors import InputError, quietly
from foldyn.gradients.linearized import Products, refuse
from foldyn.gradients.parameters import Differentiated, Gradient, check_known
from foldyn.gradients.path import free_block
from foldyn.linear.excitation import drive_of, drive_terms
from foldyn.linear.frequency_domain import dynamic_stiffness
from foldyn.linear.frf import frf, quantity_of
from foldyn.linear.linearized import linearize
from foldyn.linear.modes import nodes_translated, of_spectrum, spectrum_of, unit_translations
from foldyn.statics.stability import oriented

ALONE = 1e-6  # relative distance below which eigenvalues count as one
SAME = 1e-12  # relative difference below which derivatives count as equal
KNOWN = ("frequency", "eigenvalue", "shape", "damping_ratio", "effective_mass", "participation")
Complex = NDArray[np.complex128]


class ModesGradient(Differentiated):
    """Modes of a case, with gradients of functions of the modes.

    Parameters
    ----------
    case : Case
    arguments : mapping
        Arguments of `fd.modes`.
    """

    def __init__(self, case: Case, arguments: Mapping[str, Any]) -> None:
        found = spectrum_of(case, **of_spectrum(arguments))
        refuse(found.linear, "modes")
        self.case, self.result, self._linear = case, found.result, found.linear
        self._values, self._shapes = found.spectrum.values, oriented(found.spectrum.shapes)
        self._equilibrium = arguments.get("state") == "equilibrium"
        self._products = Products(found.linear, arguments.get("state") == "equilibrium")
        self._parted = False

    def along(self, rate: Callable[[Gradient], float]) -> ModesGradient:
        """The modes for derivatives in one direction, where modes of equal frequency separate.

        rate : function that returns the derivative in this direction, from a gradient with respect
            to the numbers of the case.
        """
        other = copy(self)
        other._shapes, other._parted = self._shapes.copy(), True
        for first, last in self._clusters():
            part = self._shapes[:, first:last]
            count = last - first
            split = np.zeros((count, count))
            for i in range(count):
                for j in range(i + 1):
                    total = self._products.nothing()
                    state = self._add(part[:, i], part[:, j], 1.0, self._values[first], total)
                    self._products.add_state(state, total)
                    split[i, j] = split[j, i] = rate(total)
            other._shapes[:, first:last] = part @ np.linalg.eigh(split)[1]
        return other

    def backward(self, seeds: Mapping[str, NDArray]) -> Gradient:
        """Gradient with respect to the numbers of the case.

        seeds : derivatives of the quantity with respect to variables of the result.
        """
        check_known(seeds, KNOWN, "modes")
        total, state = self._products.nothing(), np.zeros(len(self._products.q))
        by_value, by_shape = self._seeds(seeds, total, state)
        self._check_alone(by_value, by_shape)
        for k in np.flatnonzero((by_value != 0.0) | by_shape.any(axis=0)).tolist():
            value, shape = self._values[k], self._shapes[:, k]
            by = by_value[k]
            state += self._add(shape, shape, by, by * value, total)
            if by_shape[:, k].any():
                z, c = self._nelson(k, by_shape[:, k])
                state += self._add(z, shape, -1.0, -value, total)
                self._products.add_mass(shape, shape, -0.5 * c, total)
        self._products.add_state(state, total)
        return total

    # ------------------------------------------------------------------ parts
    def _seeds(
        self, seeds: Mapping[str, NDArray], total: dict[str, NDArray], state: NDArray
    ) -> tuple[NDArray, NDArray]:
        """Derivatives with respect to eigenvalues (k,) and shapes (nf, k).

        Derivatives with respect to anything else are added to `total` and `state`.
        """
        linear, values, shapes = self._linear, self._values, self._shapes
        zeros = np.zeros(len(values))
        with np.errstate(invalid="ignore"):
            omega = np.sqrt(values)
        by_value = np.array(seeds.get("eigenvalue", zeros), float)
        by_frequency = np.asarray(seeds.get("frequency", zeros), float)
        self._check_vibrates(by_frequency)
        with np.errstate(divide="ignore", invalid="ignore"):
            by_value += np.where(by_frequency != 0.0, by_frequency / (4.0 * np.pi * omega), 0.0)
        by_shape = np.zeros_like(shapes)
        if "shape" in seeds:
            by_shape += np.stack([linear.projected(np.ravel(one)) for one in seeds["shape"]], 1)
        by_factor = np.array(seeds.get("participation", np.zeros((len(values), 3))), float)
        if "effective_mass" in seeds:
            by_factor += 2.0 * self.result["participation"].values * seeds["effective_mass"]
        # phi' M r is the same for r = the allowed motions closest to unit translations
        by_shape += linear.mass @ (unit_translations(linear) @ by_factor.T)
        moved = nodes_translated(self.case).T.reshape(3, -1, 3)
        for k, a in np.argwhere(by_factor != 0.0):
            self._products.add_mass(shapes[:, k], moved[a], float(by_factor[k, a]), total)
        by_ratio = np.asarray(seeds.get("damping_ratio", zeros), float)
        self._check_vibrates(by_ratio)
        for k in np.flatnonzero(by_ratio):
            self._check_damping()
            shape, by, rayleigh = shapes[:, k], by_ratio[k] / (2.0 * omega[k]), self.case.rayleigh
            stiff = linear.stiffness @ shape
            by_shape[:, k] += 2.0 * by * (linear.damping @ shape)
            by_value[k] -= by_ratio[k] * self.result["damping_ratio"].values[k] / (2.0 * values[k])
            total["alpha"] += by * float(shape @ (linear.mass @ shape))
            total["beta"] += by * float(shape @ stiff)
            state += self._add(shape, shape, by * rayleigh.beta, -by * rayleigh.alpha, total)
        return by_value, by_shape

    def _add(
        self, z: NDArray, shape: NDArray, by_stiffness: float, by_mass: float,
        total: dict[str, NDArray],
    ) -> NDArray:  # fmt: skip
        """Add the gradient of by_stiffness z' K shape - by_mass z' M shape; returns the q part."""
        self._products.add_mass(z, shape, -by_mass, total)
        return self._products.add_stiffness(z, shape, by_stiffness, total)

    def _nelson(self, k: int, by_shape: NDArray) -> tuple[NDArray, float]:
        """Solution z, c of the system for shapes in the module docstring."""
        linear = self._linear
        carried = sparse.csc_array((linear.mass @ self._shapes[:, k])[:, None])
        matrix = linear.stiffness - self._values[k] * linear.mass
        bordered = sparse.block_array([[matrix, carried], [carried.T, None]], format="csc")
        found = splu(bordered).solve(np.append(by_shape, 0.0))
        return found[:-1], float(found[-1])

    # ------------------------------------------------------------------ refusals
    def _clusters(self) -> list[tuple[int, int]]:
        """First and last + 1 of each group of modes with a common eigenvalue."""
        values = self._values
        near = np.abs(np.diff(values)) <= ALONE * np.abs(values[1:])
        ends = np.flatnonzero(~near) + 1
        return [(a, b) for a, b in pairwise([0, *ends.tolist(), len(values)]) if b - a > 1]

    def _check_alone(self, by_value: NDArray, by_shape: NDArray) -> None:
        """Refuse derivatives of one of several modes with equal frequency."""
        for first, last in self._clusters():
            values = by_value[first:last]
            sum_alone = np.ptp(values) <= SAME * np.abs(values).max()
            sum_alone &= not by_shape[:, first:last].any()
            if not sum_alone and not self._parted:
                raise InputError(
                    f"modes {first + 1} to {last} have the same frequency and may swap: single "
                    "ones have no derivative. Take the sum of all, such as "
                    f'"frequency[{first + 1}] + frequency[{last}]", or the derivative in one '
                    "direction (along)"
                )

    def _check_vibrates(self, seeds: NDArray) -> None:
        """Refuse derivatives of frequencies that are 0 or nan."""
        if still := (np.flatnonzero((seeds != 0.0) & ~(self._values > 0.0)) + 1).tolist():
            raise InputError(
                f"mode {still[0]} is rigid or unstable: its frequency is "
                f"{self.result['frequency'].values[still[0] - 1]:g} and has no derivative; hold "
                "the sheet, ask for a higher mode, or take its eigenvalue"
            )

    def _check_damping(self) -> None:
        """Refuse derivatives of damping ratios from anything but alpha and beta."""
        if self._equilibrium or not _is_rayleigh(self.case):
            raise InputError(
                "there are derivatives of damping ratios for alpha and beta about rest alone; "
                "leave out other dampers, or vary the parameters by fd.sweep"
            )


class FrfGradient(Differentiated):
    """A frequency response of a case, with gradients of functions of the response.

    Parameters
    ----------
    case : Case
    arguments : mapping
        Arguments of `fd.frf`.
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
        with quietly():  # `frf` has warned already
            self._linear = linearize(
                case, state, secant=given.get("secant"), load_factor=given.get("load_factor", 1.0)
            )
            self._drive = drive_of(case, given["drive"], given.get("amplitude", 1.0))
        refuse(self._linear, "frequency responses")
        self._axis = None if self._drive.axis is None else AXES.index(self._drive.axis)
        if self._axis is not None and self._linear.ground[:, self._axis].any():
            raise InputError(
                "there are no gradients of transmissibilities if springs are attached to the "
                "ground, not the base; attach their ends to fixed nodes"
            )
        self._products = Products(self._linear, equilibrium)

    def backward(self, seeds: Mapping[str, NDArray]) -> Gradient:
        """Gradient with respect to the numbers of the case.

        seeds : complex derivatives s of the quantity with respect to the response x; the quantity
            changes by Re(s' dx).
        """
        known = quantity_of(self.result)
        check_known(seeds, [known], "this frequency response")
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
        """Add the contribution of one frequency (Hz) to `total`, `state` and `reference`.

        by : derivatives (3n,) with respect to the response.
        state, reference : derivatives (m,) with respect to the states of K and K0.
        """
        linear, rayleigh = self._linear, self.case.rayleigh
        omega = 2.0 * np.pi * frequency
        factors = splu(dynamic_stiffness(linear, omega))
        terms = drive_terms(linear, self._drive)
        x = factors.solve(np.sum([term.shape * term.factor(omega) for term in terms], axis=0) + 0j)
        z = factors.solve(linear.projected(by.real) + 1j * linear.projected(by.imag))
        if not np.isfinite(x).all():
            raise InputError(
                f"there is no response at {frequency:g} Hz: give the case damping, such as "
                "Rayleigh(alpha=...), or take other frequencies"
            )
        damped, mass = 1j * omega * rayleigh.beta * z, (1j * omega * rayleigh.alpha - omega**2) * z
        state += self._add_products(self._products, -z, x, total)
        reference += self._add_products(self._reference, -damped, x, total)
        self._products.add_mass(-mass.real, x.real, 1.0, total)
        self._products.add_mass(-mass.imag, x.imag, -1.0, total)
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
        """Add the gradient of Re(z' K x), z and x complex; returns its derivatives (m,) to dofs."""
        real = products.add_stiffness(z.real, x.real, 1.0, total)
        return real + products.add_stiffness(z.imag, x.imag, -1.0, total)

    @cached_property
    def _reference(self) -> Products:
        """Products with K0, the matrix of stiffness-proportional damping, at rest or in a state."""
        if self.case.rayleigh.state != "rest" or not self._linear.displacement.any():
            return self._products
        return Products(self._linear, False, np.zeros_like(self._linear.displacement))

    @cached_property
    def _stiffness(self) -> sparse.csc_array:
        """Stiffness matrix K0 (nf, nf)."""
        return free_block(self.case, self._reference.q, self._linear.free)[1]


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
    if not _is_rayleigh(case):
        raise InputError(
            "there are gradients of frequency responses with alpha and beta alone: damping ratios "
            "of modes change with the modes; give Rayleigh.from_ratios, leave out other dampers, "
            "or vary the parameters by fd.sweep"
        )


def _is_rayleigh(case: Case) -> bool:
    """Whether alpha and beta are the only damping of a case."""
    plain = all(isinstance(part, Rayleigh) for part in case.dampings)
    return plain and not case.dashpots and not case.crease_damping.any()
