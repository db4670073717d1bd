"""`frf`: the frequency response of a case."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.cases import BaseMotion, Case, Force, State
from foldyn.dynamics.progress import Reporter, reporter
from foldyn.errors import FoldynWarning, InputError
from foldyn.linear.answer import Answer
from foldyn.linear.burst_random import BurstRandom, burst_random
from foldyn.linear.direct import Direct, direct
from foldyn.linear.eigen import SHIFT
from foldyn.linear.equilibrium import station
from foldyn.linear.excitation import Drive, drive_of
from foldyn.linear.harmonic import REFERENCE, HarmonicBalance, harmonic
from foldyn.linear.impulse import Impulse, impulse
from foldyn.linear.linearized import Linearized, linearize
from foldyn.linear.modal import Modal, modal
from foldyn.linear.pencil import Pencil
from foldyn.linear.stepped_sine import SteppedSine, stepped_sine
from foldyn.linear.time_domain import Rig
from foldyn.linear.transmissibility import absolute
from foldyn.memory import check_memory
from foldyn.results import frf_dataset
from foldyn.values import choice, number, numbers, suggest

if TYPE_CHECKING:
    import xarray


class ResponseMethod(NamedTuple):
    """A way to a frequency response.

    `compute` takes what moves, a `Linearized` with its drive if `linear`, else a `Rig`; then the
    frequencies, an object of `options` and a reporter, and gives an `Answer`. A method with a
    `secant` (degrees) finds the slopes of superlinear hinges itself, starting from those.
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

COPIES = 4  # of the response, while it is found and stored


def frf(
    case: Case,
    drive: Force | BaseMotion | Sequence[Force | BaseMotion],
    frequencies: ArrayLike,
    state: State | str | None = None,
    method: str = "direct",
    *,
    secant: float | None = None,
    amplitude: float = 1.0,
    load_factor: float = 1.0,
    progress: bool | Reporter | None = None,
    **options: Any,
) -> xarray.Dataset:
    """Frequency response of a case about a state: displacement per force, or per motion of a base.

    Parameters
    ----------
    case : Case
        Its loads and imposed displacements are preloads, in full; histories play no part, nor do
        motions of the base.
    drive : sequence of Force, or a BaseMotion
        What moves it, without a history: forces in phase with each other, or the motion of all
        that `Fix` holds along an axis.
    frequencies : array_like
        Frequencies (Hz), increasing. For `impulse` and `burst_random` multiples of one spacing,
        as numpy.arange(0.5, 20, 0.1).
    state : State or "equilibrium", optional
        About which: a state, as `fd.initial_state(path)`; the equilibrium under the loads, found
        by statics; without it the rest state, in which no load acts.
    method : {"direct", "modal", "harmonic", "impulse", "stepped_sine", "burst_random"}
        "direct" and "modal" linearize the case; "harmonic" does so for the swing that the drive
        gives to each superlinear hinge; the others simulate its motion and estimate the response
        from it, with all that is nonlinear in it.
    secant : float, optional
        For "direct" and "modal": amplitude (degrees) for which superlinear hinges have their
        equivalent slope.
    amplitude : float
        Factor on the drive, for structures whose response depends on it.
    load_factor : float
        How far actuated folds are folded in a given state.
    progress : bool or callable, optional
        True shows a bar; a callable gets a `Progress`: for methods that simulate, of the simulated
        time, for the others of the number of frequencies.
    **options
        Of the method: the fields of `linear.Modal`, `linear.HarmonicBalance`, `linear.Impulse`,
        `linear.SteppedSine` and `linear.BurstRandom`.

    Returns
    -------
    xarray.Dataset
        Dimensions frequency, node, axis. `receptance` (m/N): displacement over the sum of the
        magnitudes of the nodal forces, attribute `drive_force`; or `transmissibility`: absolute
        displacement over that of the base. Complex, for the time dependence exp(+i w t): a lag is
        a negative phase; nan where there is none. `displacement` of the state and `drive`, its
        amplitudes. `coherence` (burst_random), `unsteadiness` (stepped_sine) or `swing` (harmonic).
        Attributes tell the method, its options and facts about the run.

    Raises
    ------
    InputError
        An argument out of range; a drive of held axes only; frequencies that the sampling does not
        resolve.
    ComputationError
        No equilibrium is found, or a simulated motion fails.

    Warns
    -----
    FoldynWarning
        The state is no equilibrium, or an unstable one; hinges have no slope; a resonance without
        damping; a motion that has not died away or settled.

    Notes
    -----
    Damping is C = alpha M + beta K0. Peaks and their damping: `linear.peaks_of`; velocities and
    accelerations per force: `linear.convert`.

    Examples
    --------
    >>> import foldyn as fd
    >>> pattern = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=60)
    >>> s = fd.discretize(pattern, fd.Sheet(1e6, 0.25, 0.01, 1.0), bend_law="linear")
    >>> supports = [fd.Fix([4, 5], "xyz"), fd.Fix([0, 1], "z")]
    >>> case = fd.Case(s, supports, damping=fd.Rayleigh(alpha=0.5))
    >>> response = frf(case, fd.Force([0, 1], (1e-3, 0, 0)), [0.0, 1.0])
    >>> abs(response.receptance).sel(node=0, axis="x").values.round(1).tolist()
    [12.6, 4.6]
    """
    if not isinstance(case, Case):
        raise InputError(f"case: got {type(case).__name__}, give a Case")
    way = METHODS[choice("method", method, METHODS)]
    chosen = _options(way, options)
    frequency = _frequencies(frequencies, way)
    check_memory(
        "frequencies", f"the response at {len(frequency)} frequencies",
        16.0 * COPIES * len(frequency) * case.structure.nodes.size, "take fewer",
    )  # fmt: skip
    driven = drive_of(case, drive, number("amplitude", amplitude, above=0.0))
    report, close = reporter(progress)
    began = time.perf_counter()
    try:
        compute = _linear if way.linear else _in_time
        at, found = compute(
            case, driven, frequency, state, secant, load_factor, way, chosen, report
        )
    finally:
        close()
    facts = {
        "method": way.name,
        **driven.facts(),
        "state": state if isinstance(state, str) else "rest" if state is None else "given",
        "secant": secant,
        "alpha": case.damping.alpha,
        "beta": case.damping.beta,
        **found.facts,
        "wall_seconds": time.perf_counter() - began,
    }
    return frf_dataset(
        case, frequency, driven.quantity, found.response, at, driven.vector, facts, found.more
    )


def _linear(
    case: Case, drive: Drive, frequency: NDArray, state: Any, secant: float | None,
    load_factor: float, way: ResponseMethod, options: Any, report: Reporter,
) -> tuple[NDArray, Answer]:  # fmt: skip
    if way.secant is not None:
        _refuse_secant(secant, way, "finds the swing of each hinge itself")
        secant = way.secant
    system = linearize(case, state, secant, load_factor)
    _warn_of_instability(system)
    found = way.compute(system, drive, frequency, options, report)
    return system.displacement, Answer(
        absolute(system, drive, found.response),
        found.more,
        {"soft_hinges": system.soft, **found.facts},
    )


def _warn_of_instability(system: Linearized) -> None:
    pencil = Pencil(system.stiffness, system.mass)
    unstable = pencil.below(-SHIFT * pencil.scale)
    if unstable:
        warnings.warn(
            f"the state is an unstable equilibrium ({unstable} negative eigenvalues): a motion "
            "leaves it, and the response is that of the equations only",
            FoldynWarning,
            stacklevel=4,
        )


def _in_time(
    case: Case, drive: Drive, frequency: NDArray, state: Any, secant: float | None,
    load_factor: float, way: ResponseMethod, options: Any, report: Reporter,
) -> tuple[NDArray, Answer]:  # fmt: skip
    _refuse_secant(secant, way, "takes the laws as they are")
    rig = Rig(station(case, state, load_factor), drive, options)
    found = way.compute(rig, frequency, options, report)
    facts = {"integrator": rig.integrator, "dt": options.dt, **found.facts}
    return rig.state, found._replace(facts=facts)


def _refuse_secant(secant: float | None, way: ResponseMethod, why: str) -> None:
    if secant is not None:
        raise InputError(
            f" = {secant!r}: the method {way.name} {why}; leave secant out, and give the "
            "amplitude of the drive instead",
            "secant",
        )


def _options(way: ResponseMethod, given: Mapping[str, Any]) -> Any:
    known = [field.name for field in fields(way.options)]
    for name in given:
        if name not in known:
            takes = f"it takes {', '.join(known)}" if known else "it takes no options of its own"
            raise InputError(
                f"{name}: is no option of the method {way.name}; {suggest(name, known)}{takes}"
            )
    return way.options(**given)


def _frequencies(given: ArrayLike, way: ResponseMethod) -> NDArray[np.float64]:
    frequency = np.atleast_1d(numbers("frequencies", given))
    if frequency.ndim != 1 or not frequency.size:
        raise InputError(
            ": give a list of frequencies (Hz), as numpy.arange(1, 20, 0.1)", "frequencies"
        )
    if frequency[0] < 0.0 or (np.diff(frequency) <= 0.0).any():
        raise InputError(
            ": must increase from 0 Hz or more; sort them and drop doubles", "frequencies"
        )
    if frequency[0] == 0.0 and way.name in ("stepped_sine", "burst_random"):
        raise InputError(f": {way.name} cannot give 0 Hz; begin above it", "frequencies")
    if frequency[-1] == 0.0 and not way.linear:
        raise InputError(": 0 Hz alone needs statics, or the direct method", "frequencies")
    return frequency
