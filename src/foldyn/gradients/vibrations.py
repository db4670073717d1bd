"""Gradients of natural frequencies, and of other functions of modes.

With phi' M phi = 1 an eigenvalue has d lambda = phi' (dK - lambda dM) phi (Nelson, AIAA Journal 14,
1976): products as in `gradients.linearized`.

A shape has d phi from (K - lambda M) d phi = -(dK - lambda dM - d lambda M) phi with
phi' M d phi = -phi' dM phi / 2. With the derivatives s of a quantity by the shape, and the solution
of (K - lambda M) z + c M phi = s, phi' M z = 0,

    s' d phi = -z' (dK - lambda dM) phi - c/2 phi' dM phi.

K also depends on the dofs in balance: all of them in an equilibrium, massless ones about rest. With
K mu = the derivatives of the quantity by these dofs, they add -mu' dR, R their residual.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from copy import copy
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from foldyn.cases import Case, Rayleigh
from foldyn.errors import InputError
from foldyn.gradients.linearized import Products, refuse
from foldyn.gradients.parameters import Gradient, numbers_of
from foldyn.linear.modes import nodes_translated, spectrum_of, unit_translations
from foldyn.mechanics.pullback import Arrays
from foldyn.statics.stability import oriented

ALONE = 1e-6  # relative distance below which eigenvalues count as one
SAME = 1e-12  # relative difference below which derivatives count as equal
KNOWN = ("frequency", "eigenvalue", "shape", "damping_ratio", "effective_mass", "participation")


class ModesGradient:
    """Modes of a case, with gradients of functions of them.

    Parameters
    ----------
    case : Case
    arguments : mapping
        Arguments of `fd.modes`.

    Attributes
    ----------
    result : xarray.Dataset
        As from `fd.modes`.
    """

    def __init__(self, case: Case, arguments: Mapping[str, Any]) -> None:
        found = spectrum_of(case, **arguments)
        refuse(found.linear, "modes")
        self.case, self.result, self._linear = case, found.result, found.linear
        self._values, self._shapes = found.spectrum.values, oriented(found.spectrum.shapes)
        self._equilibrium = arguments.get("state") == "equilibrium"
        self._products = Products(found.linear, arguments.get("state") == "equilibrium")
        self._parted = False

    def numbers(self, case: Case) -> Arrays:
        """Numbers of a case with respect to which gradients are taken."""
        return numbers_of(case)

    def along(self, rate: Callable[[Gradient], float]) -> ModesGradient:
        """These modes for derivatives in one direction, in which modes of equal frequency separate.

        rate : derivative in this direction, from a gradient by the numbers of the case.
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

        seeds : derivatives of the quantity by variables of the result.
        """
        if unknown := [name for name in seeds if name not in KNOWN]:
            raise InputError(
                f"there are no derivatives through {', '.join(unknown)} of modes, but through "
                f"{', '.join(KNOWN)}"
            )
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
        """Derivatives by eigenvalues (k,) and shapes (nf, k); adds others to `total`, `state`."""
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
        # allowed motions r closest to unit translations have the same phi' M r
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
        """Add the gradient of by_stiffness z' K shape - by_mass z' M shape; returns that by q."""
        self._products.add_mass(z, shape, -by_mass, total)
        return self._products.add_stiffness(z, shape, by_stiffness, total)

    def _nelson(self, k: int, by_shape: NDArray) -> tuple[NDArray, float]:
        """Solution z, c of the bordered system of the module docstring."""
        linear = self._linear
        carried = sparse.csc_array((linear.mass @ self._shapes[:, k])[:, None])
        matrix = linear.stiffness - self._values[k] * linear.mass
        bordered = sparse.block_array([[matrix, carried], [carried.T, None]], format="csc")
        found = splu(bordered).solve(np.append(by_shape, 0.0))
        return found[:-1], float(found[-1])

    # ------------------------------------------------------------------ where there is none
    def _clusters(self) -> list[tuple[int, int]]:
        """First and last + 1 of modes with a common eigenvalue."""
        values = self._values
        near = np.abs(np.diff(values)) <= ALONE * np.abs(values[1:])
        ends = np.flatnonzero(~near) + 1
        edges = [0, *ends.tolist(), len(values)]
        return [(a, b) for a, b in pairwise(edges) if b - a > 1]

    def _check_alone(self, by_value: NDArray, by_shape: NDArray) -> None:
        """Refuse derivatives of one of several modes with equal frequency."""
        for first, last in self._clusters():
            values = by_value[first:last]
            sum_alone = not by_shape[:, first:last].any() and np.ptp(values) <= SAME * np.abs(
                values
            ).max(initial=0.0)
            if not sum_alone and not self._parted:
                raise InputError(
                    f"modes {first + 1} to {last} have one frequency, and change places: alone "
                    "they have no derivative. Take the sum of all, such as "
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
        case = self.case
        plain = all(isinstance(part, Rayleigh) for part in case.dampings)
        if not plain or case.dashpots or case.crease_damping.any() or self._equilibrium:
            raise InputError(
                "there are derivatives of damping ratios for alpha and beta about rest alone; "
                "leave out other dampers, or vary the parameters by fd.sweep"
            )
