"""`frf`: the frequency response of a case, as receptance, mobility or accelerance."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from typing import Any, NamedTuple

import numpy as np
import xarray
from numpy.typing import ArrayLike, NDArray

from foldyn.algebra.eigen import SHIFT, Pencil
from foldyn.cases import BaseMotion, Case, Force, State
from foldyn.condensation import Superelements
from foldyn.dynamics.progress import Reporter, reported
from foldyn.errors import InputError, ModelRangeWarning, quietly, warn
from foldyn.linear.excitation import NAMED, Answer, absolute, drive_of
from foldyn.linear.frequency_domain import Direct, Modal, direct, modal
from foldyn.linear.harmonic import REFERENCE, HarmonicBalance, harmonic
from foldyn.linear.linearized import Linearized, linearize, warn_beyond
from foldyn.linear.model_error import ALONE, DOUBTFUL, Beside, beside
from foldyn.linear.modes import trusted, warn_of_stretch
from foldyn.linear.time_domain import Rig, SteppedSine, stepped_sine
from foldyn.linear.transients import BurstRandom, Impulse, burst_random, impulse
from foldyn.ram_limit import check_memory
from foldyn.results import frf_dataset
from foldyn.results.quantities import RESPONSES, variable
from foldyn.signals import convert_response
from foldyn.values import choice, flag, increasing, number, of_kind, suggest


class ResponseMethod(NamedTuple):
    """A method for frequency responses.

    The first arguments of `compute` are a `Linearized` and its drive if the method is `linear`,
    else a `Rig`; then come the frequencies, an instance of `options` and a reporter. It returns an
    `Answer`. A method with a `secant` (degrees) finds the slopes of superlinear hinges itself,
    starting from that amplitude.
    """

    name: str
    options: type
    compute: Callable[..., Answer]
    linear: bool
    secant: float | None = None

    @property
    def by_amplitude(self) -> bool:
        """Whether the response depends on the amplitude of the drive."""
        return not self.linear or self.secant is not None


METHODS: Mapping[str, ResponseMethod] = {
    method.name: method
    for method in (
        ResponseMethod("direct", Direct, direct, linear=True),
        ResponseMethod("modal", Modal, modal, linear=True),
        ResponseMethod("harmonic", HarmonicBalance, harmonic, linear=True, secant=REFERENCE),
        ResponseMethod("impulse", Impulse, impulse, linear=False),
        ResponseMethod("stepped_sine", SteppedSine, stepped_sine, linear=False),
        ResponseMethod("burst_random", BurstRandom, burst_random, linear=False),
    )
}

COPIES = 4  # copies of the response in memory, while it is computed and stored
PER_FORCE = tuple(name for name in RESPONSES if name != "transmissibility")


def frf(
    case: Case,
    drive: Force | BaseMotion | Sequence[Force | BaseMotion],
    *,
    frequencies: ArrayLike,
    state: State | str | None = None,
    method: str = "direct",
    secant: float | None = None,
    amplitude: float = 1.0,
    load_factor: float = 1.0,
    progress: bool | Reporter | None = None,
    check_model: bool = True,
    **options: Any,
) -> xarray.Dataset:
    """Frequency response of a case about a state: displacement per force, or per motion of a base.

    Parameters
    ----------
    case : Case
        Loads and imposed displacements of the case are preloads, in full; histories and base
        motions are ignored.
    drive : sequence of Force, or a BaseMotion
        Drive without a history: forces in phase with each other, or the common motion of all nodes
        that `Fix` holds along an axis.
    frequencies : array_like
        Frequencies (Hz), increasing. For `impulse` and `burst_random` multiples of one spacing,
        such as numpy.arange(0.5, 20, 0.1).
    state : State or "equilibrium", optional
        State to linearize about: a state, such as `fd.initial_state(path)`; or "equilibrium", the
        equilibrium under the loads, found by statics; by default the rest state, in which no load
        acts.
    method : {"direct", "modal", "harmonic", "impulse", "stepped_sine", "burst_random"}
        "direct" and "modal" linearize the case; "harmonic" linearizes each superlinear hinge for
        its own swing under the drive; the other methods simulate motions and estimate the response
        from these, including all nonlinearities.
    secant : float, optional
        For "direct" and "modal": amplitude (degrees) at which superlinear hinges take their
        equivalent slope.
    amplitude : float
        Factor on the drive, for structures whose response depends on the amplitude.
    load_factor : float
        Load factor of actuated folds in a given state.
    progress : bool or callable, optional
        True shows a bar; a callable gets a `Progress`, in simulated time for methods that simulate
        motions, in frequencies for the others.
    check_model : bool
        Whether to compare the modes of bars and hinges at rest with those of superelements, where
        that takes a few seconds at most; as in `modes`.
    **options
        Fields of `linear.Modal`, `linear.HarmonicBalance`, `linear.Impulse`,
        `linear.SteppedSine` and `linear.BurstRandom`.

    Returns
    -------
    xarray.Dataset
        Dimensions frequency, node, axis. `receptance` (m/N): displacement divided by the sum of the
        magnitudes of the nodal forces, which is the attribute `drive_force`; or `transmissibility`:
        absolute displacement divided by base displacement. Complex, for the time dependence exp(+i
        w t): a lag is a negative phase; nan if there is no response. `displacement` of the state,
        and `drive`, the amplitudes of the drive. `coherence` (burst_random), `unsteadiness`
        (stepped_sine) or `swing` (harmonic). Attributes hold the method, its options and facts
        about the run, also `holds_to` (Hz), up to which modes are estimated to be within 5 %: of
        superelements, and of bars and hinges that are compared with them. The latter have
        `mode_frequencies` (Hz) and their relative errors, `model_error` (nan: lost).

    Raises
    ------
    InputError
        An argument out of range; a drive on held axes only; frequencies that the sampling does not
        resolve.
    ComputationError
        No equilibrium is found, or a simulated motion fails.

    Warns
    -----
    FoldynWarning
        The state is not an equilibrium, or is unstable; hinges have no slope; a resonance without
        damping; a motion that has not decayed or settled.
    ModelRangeWarning
        Frequencies lie above the range of the model.

    Notes
    -----
    All damping of the case is included, linearized in the state. `linear.peaks_of` finds peaks and
    their damping; `linear.convert` gives velocities and accelerations per force.

    Examples
    --------
    >>> import foldyn as fd
    >>> pattern = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=60)
    >>> s = fd.discretize(pattern, fd.Sheet(1e6, 0.25, 0.01, 1.0))
    >>> supports = [fd.Fix([4, 5], "xyz"), fd.Fix([0, 1], "z")]
    >>> case = fd.Case(s, supports, damping=fd.Rayleigh(alpha=0.5))
    >>> response = frf(case, fd.Force([0, 1], (1e-3, 0, 0)), frequencies=[0.0, 1.0])
    >>> abs(response.receptance).sel(node=0, axis="x").values.round(1).tolist()
    [17.7, 4.3]
    """
    of_kind("case", case, Case)
    way = METHODS[choice("method", method, METHODS)]
    chosen = _options(way, options)
    frequency = _frequencies(frequencies, way)
    check_memory(
        "frequencies", f"the response at {len(frequency)} frequencies",
        16.0 * COPIES * len(frequency) * case.structure.nodes.size, "take fewer",
    )  # fmt: skip
    driven = drive_of(case, drive, number("amplitude", amplitude, above=0.0))
    if secant is not None and way.by_amplitude:
        why = "finds the swing of each hinge itself" if way.linear else "takes the laws as they are"
        raise InputError(
            f" = {secant!r}: the method {method} {why}; leave secant out, and give the amplitude "
            "of the drive instead",
            "secant",
        )
    began, compared, judged = time.perf_counter(), ALONE, flag("check_model", check_model)
    with reported(progress) as report:
        if way.linear:
            system = linearize(case, state, secant=way.secant or secant, load_factor=load_factor)
            _warn_of_instability(system)
            compared = beside(case, judged and not way.by_amplitude, state, secant)
            answer = way.compute(system, driven, frequency, chosen, report)
            if compared.case is None:
                _warn_of_stretch(system, frequency, answer.response)
            response, displacement = absolute(system, driven, answer.response), system.displacement
            own: dict[str, Any] = {"soft_hinges": system.soft, "not_compared": compared.why}
            if compared.case is not None or isinstance(case.structure, Superelements):
                own |= _trusted(case, float(frequency.max()), compared)
        else:
            rig = Rig(case, state, load_factor, driven, chosen)
            answer = way.compute(rig, frequency, chosen, report)
            response, displacement = answer.response, rig.state
            own = {"integrator": rig.integrator, "dt": chosen.dt}
    if compared.case is None:
        warn_beyond(case.structure, frequency, linear=not way.by_amplitude)
    facts = {
        "method": method,
        **driven.facts(),
        "state": state if isinstance(state, str) else "rest" if state is None else "given",
        "secant": secant,
        "alpha": case.rayleigh.alpha,
        "beta": case.rayleigh.beta,
        **own,
        **answer.facts,
        "wall_seconds": time.perf_counter() - began,
    }
    return frf_dataset(
        case, frequency, driven.quantity, response, displacement, driven.vector, facts, answer.more
    )


def _trusted(case: Case, top: float, compared: Beside) -> dict[str, Any]:
    """Facts about the frequencies up to `top` (Hz) that are right; warns if some are not."""
    with quietly():
        holds, frequency, error = trusted(case, top, compared)
    own = compared.case is None
    if holds < top:
        remedy = "a higher level" if own else "superelements (fd.superelements)"
        warn(
            f"the response is estimated to hold up to {holds:.4g} Hz: above, frequencies of modes "
            f"are off by more than {DOUBTFUL:.0%}, missing or not estimated; take {remedy} or "
            "lower frequencies",
            "superelements.md#errors",
            ModelRangeWarning,
        )
    more = {} if own else {"mode_frequencies": frequency, "model_error": error}
    return {"holds_to": holds, **more}


def _warn_of_instability(system: Linearized) -> None:
    """Warn if the state is an unstable equilibrium."""
    pencil = Pencil(system.stiffness, system.mass)
    unstable = pencil.below(-SHIFT * pencil.scale)
    if unstable:
        warn(
            f"the state is an unstable equilibrium ({unstable} negative eigenvalues): a motion "
            "leaves it, so that this response is never observed; give a stable state",
            "modes.md#rigid-and-unstable-modes",
        )


def _warn_of_stretch(system: Linearized, frequency: NDArray, response: NDArray) -> None:
    """Warn if stretching holds much of the strain energy of the response (m, nf) at a peak."""
    motion = np.nan_to_num(response).T
    strain = np.einsum("im,im->m", motion.conj(), system.stiffness @ motion).real
    beside = np.concatenate([[0.0], strain, [0.0]])
    peaks = np.flatnonzero((strain > beside[:-2]) & (strain >= beside[2:]))

    def named(told: NDArray) -> str:
        listed = ", ".join(f"{f:.4g}" for f in frequency[peaks[told]][:NAMED])
        return f"the response at {listed} Hz"

    warn_of_stretch(system, motion[:, peaks], strain[peaks], named)


def _options(way: ResponseMethod, given: Mapping[str, Any]) -> Any:
    """Options of a method, from keyword arguments; refuses unknown ones."""
    known = [field.name for field in fields(way.options)]
    for name in given:
        if name not in known:
            takes = f"it takes {', '.join(known)}" if known else "it takes no options of its own"
            raise InputError(
                f"{name}: is no option of the method {way.name}; {suggest(name, known)}{takes}"
            )
    return way.options(**given)


def _frequencies(given: ArrayLike, way: ResponseMethod) -> NDArray:
    """Checked frequencies (m,), Hz, that the method can compute."""
    frequency = increasing("frequencies", given, least=0.0, unit="Hz")
    if frequency[0] == 0.0 and way.name in ("stepped_sine", "burst_random"):
        raise InputError(f": {way.name} cannot give 0 Hz; begin above it", "frequencies")
    if frequency[-1] == 0.0 and not way.linear:
        raise InputError(
            f": {way.name} needs a frequency above 0 Hz; for 0 Hz alone use statics, or the "
            "method direct",
            "frequencies",
        )
    return frequency


def quantity_of(response: xarray.Dataset) -> str:
    """The quantity of a frequency response.

    Raises
    ------
    InputError
        Not a frequency response.
    """
    held = [name for name in RESPONSES if name in getattr(response, "data_vars", ())]
    if len(held) != 1:
        raise InputError(
            f"response: got {type(response).__name__} without {', '.join(RESPONSES)}; give a "
            "frequency response, as fd.frf returns it"
        )
    return held[0]


def convert(response: xarray.Dataset, quantity: str) -> xarray.Dataset:
    """Convert a frequency response to receptance, mobility or accelerance.

    Parameters
    ----------
    response : xarray.Dataset
        A result of `frf` under forces.
    quantity : {"receptance", "mobility", "accelerance"}
        Quantity to return: displacement (m/N), velocity (m/(N s)) or acceleration (m/(N s2)) per
        force.

    Returns
    -------
    xarray.Dataset
        The response with the quantity as variable; nan at 0 Hz if a division by i w would be
        needed.

    Raises
    ------
    InputError
        Not a frequency response, a transmissibility, or an unknown quantity.
    """
    choice("quantity", quantity, PER_FORCE)
    held = quantity_of(response)
    if held not in PER_FORCE:
        raise InputError(
            "response: a transmissibility is a motion per motion: the same for displacements, "
            "velocities and accelerations"
        )
    frequency = response["frequency"].values
    values = convert_response(frequency, response[held].values, source=held, target=quantity)
    other = RESPONSES[quantity]
    named = variable(tuple(map(str, response[held].dims)), values, other.units, other.text)
    return response.drop_vars(held).assign({quantity: named})
