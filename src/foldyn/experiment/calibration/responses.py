"""Frequency responses in a fit: complex values or magnitudes at nodes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from foldyn.cases import BaseMotion, Case
from foldyn.cases.directions import AXES
from foldyn.errors import ComputationError, InputError
from foldyn.experiment.calibration.measurement import NodeValues, column, plain_array
from foldyn.linear import convert
from foldyn.linear.frf import METHODS
from foldyn.results.quantities import RESPONSES
from foldyn.values import choice, show

MOTION = "transmissibility"  # the quantity of a moving base; the others are per force


@dataclass(frozen=True, eq=False, kw_only=True)
class FrequencyResponse(NodeValues):
    """Frequency responses of nodes along an axis to the case's drive.

    Complex values are compared by their real and imaginary parts.

    Parameters
    ----------
    frequency : array_like, shape (f,)
        Frequencies (Hz), increasing.
    values : array_like, shape (f, m)
        Response of each node, as `fd.frf` defines it: complex, for the time dependence exp(+i w t);
        or its magnitude. NaN where not measured.
    axis : {"x", "y", "z"}
    quantity : {"receptance", "mobility", "accelerance", "transmissibility"}
        Displacement (m/N), velocity (m/(N s)) or acceleration (m/(N s2)) per newton of the driving
        forces, all their magnitudes together; or motion per motion of the base.
    magnitude : bool
        Whether the values are magnitudes.
    sigma : float or array_like, shape (f, m), optional
        Standard error of a real or an imaginary part, or of a magnitude.
    """

    frequency: Any = ()
    axis: str = "x"
    quantity: str = "receptance"
    magnitude: bool = False
    kind: ClassVar[str] = "frf"
    analysis: ClassVar[str] = "frf"
    each: ClassVar[bool] = True

    def __post_init__(self) -> None:
        """Check the arguments."""
        super().__post_init__()
        choice(self._of("axis"), self.axis, AXES)
        choice(self._of("quantity"), self.quantity, RESPONSES)
        frequency = column(self._of("frequency"), self.frequency)
        if frequency[0] < 0.0 or (np.diff(frequency) <= 0.0).any():
            raise InputError(
                f"{self._of('frequency')}: must increase from 0 Hz or more; sort the lines"
            )
        values = plain_array(self._of("values"), self.values)
        wanted = "fiu" if self.magnitude else "c"
        if values.dtype.kind not in wanted:
            what = "magnitudes are real numbers" if self.magnitude else "must be complex numbers"
            other = "leave out magnitude" if self.magnitude else "for magnitudes: magnitude = true"
            raise InputError(f"{self._of('values')}: got {values.dtype}: {what} ({other})")
        values = values.astype(np.float64 if self.magnitude else np.complex128)
        values = self._per_node(values, len(frequency), "frequencies")
        if not np.isfinite(values).any() or np.isinf(values).any():
            raise InputError(f"{self._of('values')}: must be numbers, NaN where none was measured")
        if self.magnitude and (values < 0.0).any():
            raise InputError(f"{self._of('values')}: a magnitude cannot be negative")
        self._set(frequency=frequency, values=values)
        if isinstance(self.sigma, np.ndarray | list | tuple):
            self._set(sigma=self._errors_of_lines())

    def _errors_of_lines(self) -> NDArray[np.float64]:
        sigma = plain_array(self._of("sigma"), self.sigma)
        sigma = self._per_node(sigma, len(self.frequency), "frequencies", "sigma")
        sound = sigma.dtype.kind in "fiu" and sigma.shape == self.values.shape
        if not sound or not (sigma[np.isfinite(self.values)] > 0.0).all():
            raise InputError(
                f"{self._of('sigma')}: must be a number greater than 0 for each of the "
                f"{self.values.shape} values"
            )
        return sigma.astype(np.float64)

    @property
    def unit(self) -> str:
        """Unit of the values."""
        unit = RESPONSES[self.quantity].units
        return "" if unit == "1" else unit

    def observed(self) -> NDArray[np.float64]:
        """Measured values, flattened."""
        return self._flat(self.values)

    def errors(self) -> NDArray[np.float64]:
        """Standard error of each measured value."""
        if not isinstance(self.sigma, np.ndarray):
            return super().errors()
        return self._flat(self.sigma if self.magnitude else self.sigma * (1.0 + 1.0j))

    def check(self, case: Case, arguments: Mapping[str, Any]) -> None:
        """Refuse a case that cannot predict these values."""
        super().check(case, arguments)
        if not METHODS[arguments["method"]].linear:
            linear = ", ".join(name for name, one in METHODS.items() if one.linear)
            raise InputError(
                f"{self.name}: analysis.method = {show(arguments['method'])}: estimates a response "
                "from motions, with an error that jumps with the parameters; fit with one of "
                f"{linear}"
            )
        base = any(isinstance(one, BaseMotion) for one in arguments["drive"])
        if base != (self.quantity == MOTION):
            drive = "a base" if base else "forces"
            raise InputError(
                f"{self._of('quantity')} = {show(self.quantity)}: the case is driven by {drive}, "
                f"which gives {MOTION if base else 'receptance, mobility or accelerance'}"
            )
        held = self.where(case)[case.fixed[self.where(case), AXES.index(self.axis)]]
        if held.size and not base:
            raise InputError(
                f"{self._of('nodes')}: a support holds node {held[0]} along {self.axis}; name "
                "nodes that move"
            )

    def examine(self, result: xr.Dataset, case: Case) -> None:
        """Refuse a result without finite predictions."""
        self.predicted(result, case)

    def curves(self, result: xr.Dataset, case: Case) -> NDArray[np.complex128]:
        """Response of the model at the measured frequencies, shape (f, m)."""
        held = result if self.quantity == MOTION else convert(result, self.quantity)
        lines = np.searchsorted(result["frequency"].values, self.frequency)
        whole = held[self.quantity].transpose("frequency", "node", "axis").values
        return whole[lines][:, self.where(case), AXES.index(self.axis)]

    def predicted(self, result: xr.Dataset, case: Case) -> NDArray[np.float64]:
        """Predictions of the measured values, in the order of `observed`."""
        curves = self.curves(result, case)
        lost = ~np.isfinite(curves).all(axis=1)
        if lost.any():
            raise ComputationError(
                f"{self.name}: the model has no response at {self.frequency[lost][0]:g} Hz: a "
                "resonance without damping, a body free to move at 0 Hz, or no convergence; give "
                "the case damping, or leave this frequency out"
            )
        return self._flat(np.abs(curves) if self.magnitude else curves)

    def _flat(self, curves: NDArray) -> NDArray[np.float64]:
        """Measured entries, node by node: all real parts, then all imaginary parts."""
        seen: NDArray[Any] = curves.T[np.isfinite(self.values).T]
        return np.concatenate([np.real(seen), np.imag(seen)]) if np.iscomplexobj(seen) else seen
