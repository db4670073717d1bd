"""Vibrations in a fit: natural frequencies, damping ratios, mode shapes, frequency responses."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from foldyn.analyses.sections import one_of
from foldyn.arguments import Check
from foldyn.cases import BaseMotion, Case
from foldyn.cases.directions import AXES, check_axes
from foldyn.errors import ComputationError, InputError
from foldyn.experiment.calibration.measurement import Measurement, NodeValues, column, plain_array
from foldyn.linear import convert, mac, pair_modes
from foldyn.linear.frf import METHODS
from foldyn.results.quantities import RESPONSES
from foldyn.values import numbers, show

LEAST = 0.5  # smallest MAC between a measured mode and its partner in the model
CLOSE = 0.1  # a partner is unique if its MAC exceeds that of every other mode by this
FEWEST = 2  # smallest number of components of a shape: a single one fits any shape


class Pairing(NamedTuple):
    """Pairing of measured modes with modes of the model.

    place : index (k,) of each measured mode's partner among the model's modes with stiffness.
    mac : (k, K), between measured modes and all of the model's modes with stiffness.
    """

    place: NDArray[np.int64]
    mac: NDArray[np.float64]


@dataclass(frozen=True, eq=False, kw_only=True)
class ModeShapes(NodeValues):
    """Mode shapes at nodes; only their form matters, not their sign or size.

    Each measured shape is compared with the mode of the model that has the highest MAC, among the
    modes that its case computes, scaled for the best fit. For a shape of length 1 the sum of
    squared differences is then 1 - MAC.

    Parameters
    ----------
    values : array_like, shape (k, m, a)
        Component of each mode at each node along each axis, in any unit; NaN where not measured.
        Values are stored divided by the largest component of each mode.
    axes : str
        The measured axes, such as "z" for a sensor that looks along z.
    mode : sequence of int, optional
        Numbers of the modes, for messages and figures; 1, 2, ... by default.
    sigma : float, optional
        Standard error of a component, relative to the largest component of its mode.
    """

    axes: Annotated[str, Check(check_axes)] = "xyz"
    mode: Any = None
    kind: ClassVar[str] = "mode_shapes"
    analysis: ClassVar[str] = "modes"
    unit: ClassVar[str] = ""
    adapts: ClassVar[bool] = True  # shapes are paired and scaled

    def agree(self) -> None:
        """Check the values."""
        super().agree()
        values = plain_array("values", self.values)
        if values.ndim != 3 or values.shape[2] != len(self.axes) or values.dtype.kind not in "fiu":
            raise InputError(
                f"values: shape {values.shape}, {values.dtype}: must be real numbers "
                f"(modes, nodes, axes), here (modes, nodes, {len(self.axes)})"
            )
        values = values.astype(np.float64)
        if np.isinf(values).any():
            raise InputError("values: infinite; give NaN where nothing was measured")
        self._set(mode=_numbered("mode", self.mode, len(values)))
        for number, one in zip(self.mode, values, strict=True):
            known = one[np.isfinite(one)]
            if len(known) < FEWEST or not known.any():
                raise InputError(
                    f"values: mode {number} has {len(known)} components that are "
                    f"numbers; a shape needs at least {FEWEST}, not all of them 0"
                )
        self._set(values=values / np.nanmax(np.abs(values), axis=(1, 2))[:, None, None])

    @property
    def absorbed(self) -> int:
        """One degree of freedom for the scale of each shape."""
        return len(self.values)

    @property
    def count(self) -> int:
        """Number of modes of the model needed, without modes of zero stiffness."""
        return len(self.values)

    def check(self, case: Case, arguments: Mapping[str, Any]) -> None:
        """Refuse a case that cannot predict these values."""
        super().check(case, arguments)
        nodes, axes = self.where(case), [AXES.index(axis) for axis in self.axes]
        if case.fixed[nodes][:, axes].all():
            raise InputError(
                f"{self._of('nodes')}: supports hold all of them along {', '.join(self.axes)}; "
                "name nodes and axes that move"
            )

    def pairing(self, result: xr.Dataset, case: Case) -> Pairing:
        """Pair measured modes with modes of a result so that the sum of their MAC is largest.

        Raises
        ------
        InputError
            The result has fewer modes.
        """
        shapes = self._of_model(result, case)
        _enough(self.name, len(shapes), self.count, result)
        alike = np.zeros((len(self.values), len(shapes)))
        for row, one in zip(alike, self.values, strict=True):
            seen = np.isfinite(one)
            row[:] = np.nan_to_num(mac(one[seen][None], shapes[:, seen])[0])
        return Pairing(pair_modes(alike).second, alike)

    def examine(self, result: xr.Dataset, case: Case) -> None:
        """Refuse a result unless every measured mode resembles exactly one mode of the model."""
        place, alike = self.pairing(result, case)
        kept = resisted(result)
        names, hertz = result["mode"].values[kept], result["frequency"].values[kept]
        for number, own, row in zip(self.mode, place, alike, strict=True):
            others = np.where(np.arange(len(row)) == own, 0.0, row)
            rival = int(others.argmax())
            if row[own] < LEAST:
                best = int(row.argmax())
                raise InputError(
                    f"{self.name}: mode {number} resembles no mode of the model: the largest MAC "
                    f"is {row[best]:.2f}, with mode {names[best]} ({hertz[best]:.4g} Hz); check "
                    "nodes, axes and supports, start nearer to the truth, or raise analysis.count"
                )
            if others[rival] > row[own] - CLOSE:
                raise InputError(
                    f"{self.name}: mode {number} may be mode {names[own]} of the model "
                    f"({hertz[own]:.4g} Hz, MAC {row[own]:.2f}) or mode {names[rival]} "
                    f"({hertz[rival]:.4g} Hz, MAC {others[rival]:.2f}): the measured components do "
                    "not tell them apart; measure at more nodes or axes, leave this mode out, or "
                    "lower analysis.count if one of them is too high"
                )

    def modelled(self, result: xr.Dataset, case: Case) -> NDArray[np.float64]:
        """Shapes of the partners, scaled to fit best at measured components, shape (k, m, a)."""
        shapes = self._of_model(result, case)[self.pairing(result, case).place]
        seen = np.isfinite(self.values)
        own, other = np.where(seen, shapes, 0.0), np.where(seen, self.values, 0.0)
        size = (own**2).sum(axis=(1, 2))
        scale = (own * other).sum(axis=(1, 2)) / np.where(size > 0.0, size, 1.0)
        return shapes * scale[:, None, None]

    def places(self, result: xr.Dataset, case: Case) -> NDArray[np.int64]:
        """Indices (k,) of the measured modes in a result."""
        return resisted(result)[self.pairing(result, case).place]

    def _of_model(self, result: xr.Dataset, case: Case) -> NDArray[np.float64]:
        """Shapes (K, m, a) of the model's modes with stiffness at the measured components."""
        shapes = result["shape"].transpose("mode", "node", "axis").values[resisted(result)]
        return shapes[:, self.where(case)][..., [AXES.index(axis) for axis in self.axes]]


@dataclass(frozen=True, eq=False, kw_only=True)
class ModalParameters(Measurement):
    """A number for each of several modes.

    Parameters
    ----------
    mode : sequence of int, optional
        Number of each mode in the model, counted from 1 by frequency without modes of zero
        stiffness; by default the lowest modes. With `shapes`, the numbers only serve messages and
        figures.
    shapes : ModeShapes, optional
        The shapes of the same modes, in the same order: each mode is then paired with the model's
        mode of the most similar shape, whatever its number. The shapes are not fitted.
    sigma : float or array_like, shape (k,), optional
        Standard error of each number.
    """

    mode: Any = None
    shapes: ModeShapes | None = None
    analysis: ClassVar[str] = "modes"
    each: ClassVar[bool] = True
    quantity: ClassVar[str]  # variable of modes to compare, and the field of its measured values

    def agree(self) -> None:
        """Check the values."""
        super().agree()
        values = column(self.quantity, getattr(self, self.quantity))
        self._check_values(values)
        self._set(**{self.quantity: values, "mode": self._modes(len(values))})
        if isinstance(self.sigma, np.ndarray | list | tuple):
            sigma = column("sigma", self.sigma, len(values))
            if (sigma <= 0.0).any():
                raise InputError("sigma: must be greater than 0 for each mode")
            self._set(sigma=sigma)

    def _modes(self, count: int) -> NDArray[np.int64]:
        numbered = _numbered("mode", self.mode, count)
        if self.shapes is None:
            return numbered
        if not isinstance(self.shapes, ModeShapes):
            raise InputError(f"shapes: got {show(self.shapes)}, give ModeShapes")
        if self.mode is None and len(self.shapes.mode) == count:
            return self.shapes.mode
        if not np.array_equal(self.shapes.mode, numbered):
            raise InputError(
                f"shapes: has the modes {show(self.shapes.mode.tolist())}, but there "
                f"are values of {show(numbered.tolist())}; give both for the same modes"
            )
        return numbered

    @abstractmethod
    def _check_values(self, values: NDArray[np.float64]) -> None:
        """Refuse values that no mode can have."""

    @property
    def adapts(self) -> bool:
        """Whether predictions depend on the measured values."""
        return self.shapes is not None

    @property
    def count(self) -> int:
        """Number of modes of the model needed, without modes of zero stiffness."""
        return int(self.mode.max()) if self.shapes is None else self.shapes.count

    def observed(self) -> NDArray[np.float64]:
        """Measured values, flattened."""
        return getattr(self, self.quantity)

    def check(self, case: Case, arguments: Mapping[str, Any]) -> None:
        """Refuse a case that cannot predict these values."""
        if self.shapes is not None:
            self.shapes.check(case, arguments)

    def examine(self, result: xr.Dataset, case: Case) -> None:
        """Refuse a result in which the measured modes cannot be identified."""
        if self.shapes is not None:
            self.shapes.examine(result, case)
        self.predicted(result, case)

    def places(self, result: xr.Dataset, case: Case) -> NDArray[np.int64]:
        """Indices (k,) of the measured modes in a result."""
        if self.shapes is not None:
            return self.shapes.places(result, case)
        kept = resisted(result)
        _enough(self.name, len(kept), self.count, result)
        return kept[self.mode - 1]

    def predicted(self, result: xr.Dataset, case: Case) -> NDArray[np.float64]:
        """Predictions of the measured values, in the order of `observed`."""
        return result[self.quantity].values[self.places(result, case)]


@dataclass(frozen=True, eq=False, kw_only=True)
class NaturalFrequencies(ModalParameters):
    """Natural frequencies.

    Parameters
    ----------
    frequency : array_like, shape (k,)
        Natural frequencies (Hz), increasing.
    """

    frequency: Any = ()
    kind: ClassVar[str] = "frequencies"
    quantity: ClassVar[str] = "frequency"
    unit: ClassVar[str] = "Hz"

    def _check_values(self, values: NDArray[np.float64]) -> None:
        if (values <= 0.0).any():
            raise InputError(
                f"frequency = {values.min():g}: must be greater than 0 Hz; leave out rigid motions"
            )
        back = np.flatnonzero(np.diff(values) < 0.0)
        if back.size:
            raise InputError(
                f"frequency: {values[back[0] + 1]:g} Hz comes after "
                f"{values[back[0]]:g} Hz; sort the modes by frequency"
            )


@dataclass(frozen=True, eq=False, kw_only=True)
class DampingRatios(ModalParameters):
    """Modal damping ratios.

    Parameters
    ----------
    damping_ratio : array_like, shape (k,)
        Fractions of the critical damping: 0.02 is 2 %.
    """

    damping_ratio: Any = ()
    kind: ClassVar[str] = "damping_ratios"
    quantity: ClassVar[str] = "damping_ratio"
    unit: ClassVar[str] = ""

    def _check_values(self, values: NDArray[np.float64]) -> None:
        wrong = values[(values < 0.0) | (values >= 1.0)]
        if wrong.size:
            raise InputError(
                f"damping_ratio = {wrong[0]:g}: must be from 0 to below 1 (2 % is 0.02)"
            )


def resisted(result: xr.Dataset) -> NDArray[np.int64]:
    """Indices of modes with stiffness: not rigid, mechanisms, or unstable."""
    return np.flatnonzero(result["eigenvalue"].values > 0.0)


def _enough(name: str, found: int, needed: int, result: xr.Dataset) -> None:
    """Refuse a result with fewer modes than were measured."""
    if found >= needed:
        return
    modes, most = result.sizes["mode"], int(result.attrs["free_dofs"])
    what = f"mode {needed} was measured, but the model has only {found} that something resists"
    if modes >= most:
        raise InputError(f"{name}: {what}; leave out higher modes, or refine it")
    raise InputError(f"{name}: {what} among its lowest {modes}; raise analysis.count")


def _numbered(name: str, given: Any, count: int) -> NDArray[np.int64]:
    """Mode numbers from 1, increasing; 1, 2, ... by default."""
    if given is None:
        return np.arange(1, count + 1)
    array = numbers(name, given)
    modes = array.astype(np.int64)
    if array.shape != (count,) or (modes != array).any() or (np.diff(modes, prepend=0) <= 0).any():
        raise InputError(
            f"{name} = {show(np.ravel(array).tolist())}: must be the increasing numbers, from 1, "
            f"of the {count} modes"
        )
    return modes


MOTION = "transmissibility"  # the quantity for a moving base; other quantities are per force


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
        Displacement (m/N), velocity (m/(N s)) or acceleration (m/(N s2)), divided by the sum of the
        magnitudes of all driving forces; or motion divided by the motion of the base.
    magnitude : bool
        Whether the values are magnitudes.
    sigma : float or array_like, shape (f, m), optional
        Standard error of a real or an imaginary part, or of a magnitude.
    """

    frequency: Annotated[Any, Check(column)] = ()
    axis: Annotated[str, one_of(AXES)] = "x"
    quantity: Annotated[str, one_of(RESPONSES)] = "receptance"
    magnitude: bool = False
    kind: ClassVar[str] = "frf"
    analysis: ClassVar[str] = "frf"
    each: ClassVar[bool] = True

    def agree(self) -> None:
        """Check the values."""
        super().agree()
        frequency = self.frequency
        if frequency[0] < 0.0 or (np.diff(frequency) <= 0.0).any():
            raise InputError("frequency: must increase from 0 Hz or more; sort it")
        values = plain_array("values", self.values)
        if values.dtype.kind not in ("fiu" if self.magnitude else "c"):
            what = "magnitudes are real numbers" if self.magnitude else "must be complex numbers"
            other = "leave out magnitude" if self.magnitude else "for magnitudes: magnitude = true"
            raise InputError(f"values: got {values.dtype}: {what} ({other})")
        values = values.astype(np.float64 if self.magnitude else np.complex128)
        values = self._per_node(values, len(frequency), "frequencies")
        if not np.isfinite(values).any() or np.isinf(values).any():
            raise InputError("values: must be numbers, NaN where none was measured")
        if self.magnitude and (values < 0.0).any():
            raise InputError("values: a magnitude cannot be negative")
        self._set(values=values)
        if isinstance(self.sigma, np.ndarray | list | tuple):
            self._set(sigma=self._errors_of_lines())

    def _errors_of_lines(self) -> NDArray[np.float64]:
        sigma = plain_array("sigma", self.sigma)
        sigma = self._per_node(sigma, len(self.frequency), "frequencies", "sigma")
        sound = sigma.dtype.kind in "fiu" and sigma.shape == self.values.shape
        if not sound or not (sigma[np.isfinite(self.values)] > 0.0).all():
            raise InputError(
                f"sigma: must be a number greater than 0 for each of the {self.values.shape} values"
            )
        return sigma.astype(np.float64)

    @property
    def unit(self) -> str:
        """Unit of the values."""
        unit = RESPONSES[self.quantity].units
        return "" if unit == "1" else unit

    def errors(self) -> NDArray[np.float64]:
        """Standard error of each measured value."""
        if not isinstance(self.sigma, np.ndarray):
            return super().errors()
        return self.flat(self.sigma if self.magnitude else self.sigma * (1.0 + 1.0j))

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

    def modelled(self, result: xr.Dataset, case: Case) -> NDArray[np.complex128]:
        """Response of the model at the measured frequencies, shape (f, m)."""
        held = result if self.quantity == MOTION else convert(result, self.quantity)
        lines = np.searchsorted(result["frequency"].values, self.frequency)
        whole = held[self.quantity].transpose("frequency", "node", "axis").values
        return whole[lines][:, self.where(case), AXES.index(self.axis)]

    def predicted(self, result: xr.Dataset, case: Case) -> NDArray[np.float64]:
        """Predictions of the measured values, in the order of `observed`."""
        curves = self.modelled(result, case)
        lost = ~np.isfinite(curves).all(axis=1)
        if lost.any():
            raise ComputationError(
                f"{self.name}: the model has no response at {self.frequency[lost][0]:g} Hz: a "
                "resonance without damping, a body free to move at 0 Hz, or no convergence; give "
                "the case damping, or leave this frequency out"
            )
        return self.flat(np.abs(curves) if self.magnitude else curves)

    def flat(self, values: NDArray) -> NDArray[np.float64]:
        """Measured values, node by node: first all real parts, then all imaginary parts."""
        seen: NDArray[Any] = values.T[np.isfinite(self.values).T]
        return np.concatenate([np.real(seen), np.imag(seen)]) if np.iscomplexobj(seen) else seen
