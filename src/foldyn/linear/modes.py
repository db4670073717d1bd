"""`modes`: natural frequencies and shapes of a case about a state.

Participation in base motions: with shapes of unit modal mass, the participation factor along an
axis is phi' M r, with r the unit translation of the free dofs along the axis. The square of the
factor is the effective mass. The effective masses of all modes add up to r' M r, the mass that is
free to move along the axis.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
import xarray
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import eigh

from foldyn.algebra.eigen import EPS, Pencil, Spectrum, lowest
from foldyn.algebra.superlu import factorize
from foldyn.cases import Case, State
from foldyn.condensation import Superelements
from foldyn.dynamics.modal_damping import mass_of
from foldyn.errors import InputError, StretchWarning, quietly, warn
from foldyn.linear import model_error
from foldyn.linear.hereditary import Branches, damped_mode
from foldyn.linear.linearized import Linearized, linearize, numbered, warn_beyond
from foldyn.ram_limit import check_memory
from foldyn.results import modes_dataset
from foldyn.statics.rigid import free_rigid_motions, of_all_dofs, rigid_motions
from foldyn.statics.stability import oriented
from foldyn.structures.stretching import most, remedy, stretching
from foldyn.values import flag, of_kind, whole

COPIES = 4  # copies of the shapes in memory, while they are found and stored
RIGID = 1.0 - 1e-6  # share in the space of rigid motions above which a shape counts as rigid
ROUNDING = 1e3 * EPS  # forces on a rigid motion r below this, relative to |K| |r|, count as zero
TURN = 2.0 * np.pi
COUNTS = (10, 40)  # numbers of modes whose errors are estimated for a frequency response
TWINS = 1e-8  # eigenvalues with a smaller relative difference count as one
INDEPENDENT = 1e-6  # least remainder after orthogonalization, relative to a motion's size


def modes(
    case: Case,
    count: int = 6,
    *,
    state: State | str | None = None,
    secant: float | None = None,
    load_factor: float = 1.0,
    verify: bool = True,
    solver: str = "auto",
    check_model: bool = True,
) -> xarray.Dataset:
    """Natural frequencies and mode shapes of a case about an equilibrium.

    Solves K phi = lambda M phi on the free dofs, with K the tangent in the state, for the lowest
    eigenvalues lambda = (2 pi f)^2.

    Parameters
    ----------
    case : Case
        Loads and imposed displacements of the case are preloads; histories are ignored.
    count : int
        Number of modes, from the lowest on, including rigid and unstable modes.
    state : State or "equilibrium", optional
        State to linearize about: a state, such as `fd.initial_state(path)`; or "equilibrium", the
        equilibrium under the loads in full; by default the rest state, in which no load acts.
    secant : float, optional
        Amplitude (degrees) by which hinges turn: superlinear hinges, which have no slope at rest,
        then get the slope equivalent to an oscillation of this amplitude.
    load_factor : float
        Load factor of actuated folds in a given state.
    verify : bool
        Whether to verify by a second factorization that no mode was missed. It costs about as much
        as the first; small problems are solved in full and do not need it.
    solver : {"auto", "superlu", "rslab", "pardiso"}
        Backend of the sparse factorization, as in the settings of `trace`.
    check_model : bool
        Whether to compare bars and hinges at rest with superelements, where that takes a few
        seconds at most.

    Returns
    -------
    xarray.Dataset
        Dimensions mode, node, axis; `mode` counts from 1. `frequency` (Hz; 0 for rigid modes, nan
        for unstable ones), `eigenvalue` (rad2/s2; negative: unstable; 0: zero to round-off),
        `shape` (phi' M phi = 1 kg m2, the largest entry positive), `rigid`, `rigid_share` (of the
        shape in the space of rigid motions), `damping_ratio` (phi' C phi / (2 omega), nan if the
        frequency is 0 or nan), `participation`, `effective_mass`, and `displacement` of the state;
        of bars and hinges at rest also `model_error`, the relative error by comparison with
        superelements of a low level (nan: no mode of theirs resembles it), and the attribute
        `missing_frequencies` (Hz), if some of their modes have no counterpart;
        in air also `air_share`, the fluid's share of the modal mass (`free_mass`, `participation`
        and `effective_mass` include the fluid); of superelements also `frequency_error` (Hz), an
        estimate of the largest error relative to a shell on a fine mesh, and `between_shape` at
        `between_position`, points on edges and in panels.
        Attributes: `free_mass` (kg along x, y, z), `complete` (number of lowest modes verified to
        be complete), `soft_hinges`, `residual` of the state, `rounding` (bound on the relative
        rounding error of the eigenvalues) and facts about the computation.

    Raises
    ------
    InputError
        An argument out of range; nothing can move; a free node without mass.
    ComputationError
        No equilibrium is found; the modes do not converge.

    Warns
    -----
    FoldynWarning
        The state is not an equilibrium, or is unstable; loads do not act at rest; hinges have no
        slope; a mode was missed.
    ModelRangeWarning
        Modes are more than 5 % off, or missing; or, if they are not compared with superelements,
        lie above the range of the model.
    StretchWarning
        Modes are not compared, and panels that stretch hold much of the strain energy of one.
    """
    of_kind("case", case, Case)
    check_model = flag("check_model", check_model)
    found = spectrum_of(
        case, count, state, secant, load_factor=load_factor, verify=verify,
        solver=solver, compared=model_error.beside(case, check_model, state, secant),
    ).result  # fmt: skip
    if check_model and isinstance(case.structure, Superelements):
        frequency, error = found["frequency"].values, found["frequency_error"].values
        model_error.warn_of_errors(case.structure, frequency, error)
    return found


class Found(NamedTuple):
    """Modes as `modes` returns them, with the system and the spectrum they come from."""

    linear: Linearized
    spectrum: Spectrum  # its shapes may differ in order and sign
    result: xarray.Dataset


def spectrum_of(
    case: Case, count: int = 6, state: State | str | None = None, secant: float | None = None, *,
    load_factor: float = 1.0, verify: bool = True, solver: str = "auto",
    errors: bool = True, compared: model_error.Beside = model_error.ALONE,
) -> Found:  # fmt: skip
    """Modes, with the linearized system and its spectrum; other arguments as in `modes`.

    errors : whether to estimate the errors of frequencies, for models that can.
    compared : what to compare the modes with.
    """
    count = whole("count", count, least=1)
    check_memory(
        "count", f"{float(count):.3g} modes", 8.0 * COPIES * count * case.structure.nodes.size,
        "take fewer",
    )  # fmt: skip
    began = time.perf_counter()
    linear = linearize(case, state, secant=secant, load_factor=load_factor)
    pencil, space, spectrum = _lowest(linear, count, solver, verify)
    if len(spectrum.values) < count:
        raise InputError(
            f" = {count}: the case has only {len(spectrum.values)} modes, as its other motions "
            "carry no mass: ask for fewer, or take a lower level or more divisions",
            "count",
        )
    along = unit_translations(linear)
    _warn(spectrum)
    if compared.case is None:
        shapes, values = spectrum.shapes, spectrum.values
        warn_of_stretch(linear, shapes, values, lambda told: numbered("mode", told + 1))
        frequency = np.sqrt(spectrum.values.clip(min=0.0)) / TURN
        warn_beyond(case.structure, frequency, "mode", linear=True)
    statistics = {
        "count": count,
        "state": state if isinstance(state, str) else "rest" if state is None else "given",
        "secant": linear.secant,
        "free_dofs": pencil.finite,
        "free_mass": np.einsum("ia,ia->a", along, linear.mass @ along),
        "residual": linear.residual,
        "soft_hinges": linear.soft,
        "complete": spectrum.checked,
        "shift": None if np.isnan(spectrum.shift) else spectrum.shift,
        "solver": pencil.backend if pencil.factorizations else "dense",
        "factorizations": pencil.factorizations,
        "largest_residual": float(pencil.residuals(spectrum.values, spectrum.shapes).max()),
        "rounding": _rounding(pencil, spectrum),
        "not_compared": compared.why,
        "wall_seconds": time.perf_counter() - began,
    }
    variables = _variables(linear, spectrum, space, along)
    if compared.case is not None:
        found = _judged(case, variables, compared.case)
        variables["model_error"] = found.error
        statistics["missing_frequencies"] = found.lost if len(found.lost) else None
    if errors and isinstance(case.structure, Superelements):
        leveled = linearize(case.altered(structure=model_error.other_level(case.structure)))
        most = min(count, Pencil(leveled.stiffness, leveled.mass).finite)
        other = np.full(len(spectrum.values), np.nan)  # a lower level may have fewer modes
        values = _lowest(leveled, most, solver, verify=False)[-1].values[:count]
        other[: len(values)] = values
        motion = linear.whole(spectrum.shapes)
        changes = (motion.T @ (part @ motion) for part in case.structure.changes(case.held_edges))
        estimate = model_error.frequency_errors(case, spectrum.values, other, changes)
        variables["frequency_error"] = np.where(variables["rigid"], 0.0, estimate)
    return Found(linear, spectrum, modes_dataset(case, variables, statistics))


def _lowest(
    linear: Linearized, count: int, solver: str, verify: bool
) -> tuple[Pencil, NDArray, Spectrum]:
    """The eigenvalue problem, its motions as a rigid body, and its lowest modes."""
    pencil, space = Pencil(linear.stiffness, linear.mass, solver), rigid_space(linear)
    return pencil, space, lowest(pencil, count, unresisted(linear, space), verify)


def of_spectrum(arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Arguments of `modes` for `spectrum_of`, which does not compare models by itself."""
    return {name: value for name, value in arguments.items() if name != "check_model"}


def trusted(
    case: Case, top: float, compared: model_error.Beside
) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]:
    """Frequency (Hz), at most `top`, up to which modes are within `DOUBTFUL`.

    Also returns the frequencies (k,), Hz, of the modes that were judged, at most the last of
    `COUNTS`, and their relative errors. Superelements estimate these themselves; bars and hinges
    are compared with them.
    """
    frequency, error, holds = np.zeros(0), np.zeros(0), 0.0
    for count in COUNTS:
        many = min(count, most_modes(case))
        found = spectrum_of(case, many, verify=False, compared=compared).result
        elastic = found["frequency"].values > 0.0
        frequency = found["frequency"].values[elastic]
        if compared.case is None:
            error = found["frequency_error"].values[elastic] / frequency
        else:
            error = found["model_error"].values[elastic]
        missing = np.ravel(found.attrs.get("missing_frequencies", ()))
        off = np.abs(np.nan_to_num(error, nan=np.inf)) * frequency
        wrong = model_error.first_doubtful(frequency, off)
        holds = min(wrong, float(missing.min(initial=np.inf)), top)
        if holds < top or many < count or not frequency.size or frequency[-1] >= top:
            break
        holds = float(frequency[-1])
    return holds, frequency, error


def most_modes(case: Case) -> int:
    """Largest number of modes of a case; in superelements edges and panels have mass as well."""
    return len(case.free_dofs) + (len(case.elastic_body.hidden) if case.structure.linear else 0)


def _variables(
    linear: Linearized, spectrum: Spectrum, space: NDArray, along: NDArray
) -> dict[str, Any]:
    """Variables of the dataset of modes."""
    values, shapes, remembered = spectrum.values, oriented(spectrum.shapes), 0.0
    if linear.branches is not None:
        values, shapes, remembered = _remembered(linear, linear.branches, values, shapes)
    with np.errstate(invalid="ignore"):
        omega = np.sqrt(values)
    modal = np.einsum("ik,ik->k", shapes, linear.damping @ shapes)
    modal = modal + ((linear.modal @ shapes) ** 2).sum(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(omega > 0.0, modal / (2.0 * omega) + remembered, np.nan)
    share = rigid_share(linear, space, shapes)
    factors = shapes.T @ (linear.mass @ along)
    return {
        **(_air(linear, shapes) if linear.added is not None else {}),
        **_between(linear, shapes),
        "frequency": omega / (2.0 * np.pi),
        "eigenvalue": values,
        "shape": linear.expanded(shapes).T.reshape(-1, *linear.displacement.shape),
        "rigid": (values == 0.0) & (share > RIGID),
        "rigid_share": share,
        "damping_ratio": ratio,
        "participation": factors,
        "effective_mass": factors**2,
        "displacement": linear.displacement,
    }


def _judged(case: Case, found: dict[str, Any], other: Case) -> model_error.Judged:
    """Modes of bars and hinges beside those of superelements; warns of large errors."""
    with quietly():
        most = min(len(found["frequency"]) + model_error.SPARE, most_modes(other))
        true = spectrum_of(other, most, verify=False, errors=False).result
    points = points_of(other, true)
    out = model_error.judged(case, found["frequency"], found["shape"], points, *elastic(true, None))
    model_error.warn_of(out.doubts(found["frequency"] > 0.0))
    return out


def elastic(found: xarray.Dataset, count: int | None) -> tuple[NDArray, NDArray]:
    """Frequencies (k,), Hz, and shapes (k, p, 3) at `points_of` of the modes with stiffness."""
    kept = np.flatnonzero(found["eigenvalue"].values > 0.0)[:count]
    names = [name for name in ("shape", "between_shape") if name in found]
    shape = np.concatenate([found[name].values[kept] for name in names], axis=1)
    return found["frequency"].values[kept], shape


def points_of(case: Case, found: xarray.Dataset) -> NDArray[np.float64]:
    """Points (p, 3), m, where modes are known: nodes, and of superelements points between them."""
    nodes = case.structure.nodes
    if "between_position" not in found:
        return nodes
    return np.concatenate([nodes, found["between_position"].values])


def _remembered(
    linear: Linearized, branches: Branches, values: NDArray, shapes: NDArray
) -> tuple[NDArray, NDArray, NDArray]:
    """Eigenvalues |s|^2, in-phase shapes, and damping ratios of modes with memory laws."""
    values, shapes, ratio = values.copy(), shapes.copy(), np.zeros(len(values))
    for k in np.flatnonzero(values > 0.0):
        s, x = damped_mode(linear.stiffness, linear.mass, branches, values[k], shapes[:, k])
        values[k], ratio[k] = abs(s) ** 2, -s.real / abs(s)
        size = np.sqrt(x.real @ (linear.mass @ x.real))
        shapes[:, k] = x.real / size
    order = np.argsort(values, kind="stable")
    _warn_of_twins(linear, values[order], shapes[:, order])
    return values[order], oriented(shapes[:, order]), ratio[order]


def _warn_of_twins(linear: Linearized, values: NDArray, shapes: NDArray) -> None:
    """Warn if two modes have converged to the same mode, so that a mode is missing."""
    for k in range(1, len(values)):
        near = abs(values[k] - values[k - 1]) <= TWINS * abs(values[k])
        if near and abs(shapes[:, k] @ (linear.mass @ shapes[:, k - 1])) > RIGID:
            warn(
                "two modes are the same with the memory of the creases "
                f"({np.sqrt(values[k]) / TURN:.4g} Hz), and one near them is missing; frequency "
                "responses are not affected",
                "laws.md#in-other-analyses",
            )


def _between(linear: Linearized, shapes: NDArray) -> dict[str, Any]:
    """Shapes (nf, k) on edges and in panels, if these are superelements."""
    structure = linear.case.structure
    if not isinstance(structure, Superelements):
        return {}
    points, motions = structure.between(linear.case.held_edges)
    return {
        "between_shape": (motions @ linear.whole(shapes)).T.reshape(shapes.shape[1], *points.shape),
        "between_position": points,
    }


def _air(linear: Linearized, shapes: NDArray) -> dict[str, Any]:
    """Share of the fluid in the modal mass of shapes (nf, k)."""
    part = np.einsum("ik,ik->k", shapes, linear.added @ shapes)
    return {"air_share": part / np.einsum("ik,ik->k", shapes, linear.mass @ shapes)}


def unit_translations(linear: Linearized) -> NDArray:
    """Unit translations (nf, 3) of the free dofs along x, y, z.

    If constraints do not allow these, or parts between nodes move with the supports, the closest
    allowed motions, weighted by mass.
    """
    if linear.case.elastic_body.sheet.mass is not None:
        own = linear.case.constraints.matrix(mass_of(linear.case))[linear.free][:, linear.free]
        return factorize(sparse.csc_array(own)).solve(linear.inertia)
    on_nodes = linear.free < linear.displacement.size
    if not linear.case.constraints:
        return (on_nodes[:, None] & (linear.free[:, None] % 3 == np.arange(3))).astype(float)
    weighted = sparse.kron(linear.case.mass, sparse.eye_array(3), format="csr")
    weighted = weighted @ nodes_translated(linear.case)
    pushed = np.stack([linear.projected(each) for each in weighted.T], axis=1)
    out = np.zeros(pushed.shape)
    mass = linear.case.constraints.matrix(mass_of(linear.case))
    nodal = linear.free[on_nodes]
    own = sparse.csc_array(mass[nodal][:, nodal])
    out[on_nodes] = factorize(own).solve(pushed[on_nodes])
    return out


def nodes_translated(case: Case) -> NDArray:
    """Unit translations (3n, 3) of all dofs that have a part in those of modes."""
    moves = ~case.fixed.ravel() | bool(case.structure.linear)  # parts move beside held nodes
    unit = moves[:, None] & (np.arange(len(moves))[:, None] % 3 == np.arange(3))
    return unit.astype(float)


def _rounding(pencil: Pencil, spectrum: Spectrum) -> float:
    """Largest relative bound on the rounding error of the nonzero eigenvalues."""
    finite = spectrum.values != 0.0
    noise = pencil.noise(spectrum.shapes[:, finite])
    return float((noise / np.abs(spectrum.values[finite])).max(initial=0.0))


def _warn(spectrum: Spectrum) -> None:
    """Warn about unstable and missed modes."""
    unstable = int((spectrum.values < 0.0).sum())
    if unstable:
        warn(
            f"the state is an unstable equilibrium: {unstable} of the {len(spectrum.values)} modes "
            "have a negative eigenvalue and no frequency (nan); give a stable state",
            "modes.md#rigid-and-unstable-modes",
        )
    if spectrum.missed:
        warn(
            f"the count of eigenvalues differs by {abs(spectrum.missed)} from the modes found: "
            "frequencies may be missing; ask for another count of modes",
            "modes.md#completeness-and-rounding",
        )


def warn_of_stretch(
    linear: Linearized, motions: NDArray, strain: NDArray, named: Callable[[NDArray], str]
) -> None:
    """Warn about motions (nf, k) in which stretching holds much of the strain energy (k,), J / 2.

    named : which motions, by their rows, in words.
    """
    structure = linear.case.structure
    limit = most(structure)
    if not np.isfinite(limit):
        return
    bars = stretching(structure, linear.displacement, linear.whole(motions))
    share = np.divide(bars, strain, out=np.zeros_like(bars), where=strain > 0.0).clip(max=1.0)
    told = np.flatnonzero(share > limit)
    if len(told):
        worst = told[share[told].argmax()]
        warn(
            f"panels that stretch hold more than {limit:.0%} of the strain energy of {named(told)} "
            f"({named(worst[None])}: {share[worst]:.0%}), {remedy(structure, linear=True)}",
            "models.md#where-panels-stretch",
            StretchWarning,
        )


def rigid_space(linear: Linearized) -> NDArray:
    """Rigid motions (nf, r) about the state that the supports allow, M-orthonormal.

    Allowed translations along x, y, z come first, then rotations.
    """
    x = linear.case.structure.nodes + linear.displacement
    allowed = free_rigid_motions(x, linear.case.constraints)
    plain = rigid_motions(x)
    chosen = np.linalg.lstsq(plain, allowed, rcond=None)[0]
    basis, _ = np.linalg.qr(chosen)
    motions = plain @ (basis @ basis.T)
    return _orthonormal(linear, of_all_dofs(linear.case.elastic_body, x, motions)[linear.free])


def _orthonormal(linear: Linearized, motions: NDArray) -> NDArray:
    """M-orthonormal basis (nf, r) of motions (nf, k), in order, without dependent motions."""
    kept: list[NDArray] = []
    for motion in motions.T:
        left = motion
        for _ in range(2):  # twice, to remove the rounding error of the first pass
            for other in kept:
                left = left - other * float(other @ (linear.mass @ left))
        size = _size(linear, left)
        if size > INDEPENDENT * _size(linear, motion) and size > 0.0:
            kept.append(left / size)
    return np.stack(kept, axis=1) if kept else np.zeros((len(linear.free), 0))


def _size(linear: Linearized, motion: NDArray) -> float:
    """Norm of a motion (nf,), weighted by mass."""
    return float(np.sqrt(motion @ (linear.mass @ motion)))


def unresisted(linear: Linearized, space: NDArray) -> NDArray:
    """Part (nf, k) of the rigid motions (nf, r) without restoring force: modes of zero frequency.

    Loads with a fixed direction resist rotations, like gravity in a pendulum; without such loads,
    nothing resists rotations in an equilibrium.
    """
    if not space.shape[1]:
        return space
    if _is_null(linear, space).all():
        return space
    _, turned = eigh(space.T @ (linear.stiffness @ space))
    turned = space @ turned
    return turned[:, _is_null(linear, turned)]


def _is_null(linear: Linearized, motions: NDArray) -> NDArray:
    """Whether the stiffness force on each motion (nf, k) is round-off (k,).

    If the state has a residual force r, a rotation by w turns it, which gives a force |w| r.
    """
    force = np.linalg.norm(linear.stiffness @ motions, axis=0)
    rounding = ROUNDING * np.linalg.norm(abs(linear.stiffness) @ np.abs(motions), axis=0)
    x = linear.case.structure.nodes + linear.displacement
    radius = float(np.linalg.norm(x - x.mean(axis=0), axis=1).max()) or 1.0
    turned = linear.unbalanced * np.abs(motions).max(axis=0) / radius
    return force <= rounding + 2.0 * turned


def rigid_share(linear: Linearized, space: NDArray, shapes: NDArray) -> NDArray:
    """Share (k,) of shapes (nf, k) in the space (nf, r) of rigid motions, weighted by mass."""
    part = space.T @ (linear.mass @ shapes)
    return (part**2).sum(axis=0) / np.einsum("ik,ik->k", shapes, linear.mass @ shapes)
