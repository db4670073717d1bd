"""Result datasets: labeled arrays that contain their own case."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from foldyn.cases import HISTORIES, Case, Continuation, Origin
from foldyn.cases.document import pattern_document, to_document
from foldyn.patterns import Pattern
from foldyn.results import quantities
from foldyn.results.attributes import facts, own_attributes
from foldyn.results.quantities import PLACE, Quantity, energies_of, variable, variables, with_reason
from foldyn.results.stored_case import CASE_VARIABLES, case_variables

AXIS = np.array(["x", "y", "z"])

TAKEN = frozenset(
    {*quantities.MOTION, *quantities.CROSSINGS, *quantities.CONTINUATIONS, *quantities.ORIGIN}
    | {*CASE_VARIABLES, "time", "node", "axis", "support", "support_node", "support_axis"}
)
"""Variable names that are taken in every motion."""


def trajectory_dataset(
    case: Case, time: ArrayLike, displacement: ArrayLike, velocity: ArrayLike,
    reaction: ArrayLike, energies: Mapping[str, ArrayLike], statistics: Mapping[str, Any],
    sampled: Mapping[str, tuple[Quantity, ArrayLike]] | None = None,
    memory: ArrayLike | None = None,
    continuations: Mapping[str, tuple[float, Continuation]] | None = None,
    origin: tuple[float, Origin] | None = None,
) -> xr.Dataset:  # fmt: skip
    """Dataset of a motion, including its case.

    Parameters
    ----------
    case : Case
        Case that moved.
    time : array_like, shape (nt,)
        Times of the samples (s).
    displacement, velocity : array_like, shape (nt, n, 3)
        Displacement (m) and velocity (m/s) of every node.
    reaction : array_like, shape (nt, ns)
        Forces of the supports (N) on the dofs in `case.reaction_dofs`, in this order.
    energies : mapping of str to array_like, shape (nt,)
        Kinetic, dissipated, work and the strain energies in the structure's `energy_groups` (J).
    statistics : mapping
        Facts about the run, each stored as an attribute. `start`, `dt` (s) and `steps` give the
        stage times t_n and t_n + dt/2 at which functions of time are sampled.
    sampled : mapping of str to (Quantity, array_like of shape (nt, ...)), optional
        Quantities that the user added.
    memory : array_like, shape (nt, b, 2), optional
        State of the branches of laws with memory, rad.
    continuations : mapping of str to (float, Continuation), optional
        `continuation`: time (s) of the last sample, and the numbers that the method needs to
        continue from it. `continued_from`: the same for the first sample.
    origin : (float, Origin), optional
        Time (s) of the last sample, and the state in which the motion began; only needed if a term
        depends on that state.

    Returns
    -------
    xarray.Dataset
        `displacement`, `velocity` (time, node, axis), `reaction` (time, support) with the
        coordinates `support_node` and `support_axis`, the energies (time), `rest_position`
        (node, axis), and the `case` (TOML). The attribute `rerunnable` is 1 when `case_of` can
        rebuild the case, else 0, and `not_rerunnable_because` holds the reason.
    """
    time = np.array(time, dtype=np.float64)
    added = sampled or {}
    known = {**quantities.MOTION, **energies_of(case)}
    known |= {name: own for name, (own, _) in added.items()}
    values = {"displacement": displacement, "reaction": reaction, "velocity": velocity, **energies}
    if memory is not None:
        values["memory"] = memory
    data = variables(known, "time", values | {name: array for name, (_, array) in added.items()})
    for name, (at, one) in (continuations or {}).items():
        told = quantities.CONTINUATIONS[name]
        along, numbers, text = variable(("continued",), one.values, "", told)
        data[name] = along, numbers, text | {"method": one.method, "time": at}
    data |= {} if origin is None else origin_variables(origin[1], origin[0])
    parts = (*case.supports, *case.loads, case.air)
    histories = [*(getattr(part, "history", None) for part in parts), *case.elastic_body.histories]
    called = any(type(one) not in HISTORIES.values() for one in histories if one is not None)
    times = stage_times(statistics) if called else None
    along = {"time": ("time", time, {"units": "s", "long_name": "time"})}
    return result_dataset("trajectory", case, data, along, statistics, times)


def origin_variables(origin: Origin, time: float = math.nan) -> dict[str, Any]:
    """Variables of the state in which a motion began, for a result that ends at `time` (s)."""
    begun = math.nan if origin.time is None else origin.time
    values: dict[str, Any] = {"origin": origin.displacement, "origin_time": begun}
    if origin.flow is not None:
        values |= {"flow": origin.flow, "flow_time": time, "flow_looked": origin.looked}
    return variables(quantities.ORIGIN, (), values)


def path_dataset(
    case: Case, load_factor: ArrayLike, displacement: ArrayLike, reaction: ArrayLike,
    energies: Mapping[str, ArrayLike], solution: Mapping[str, ArrayLike],
    statistics: Mapping[str, Any], obstacles: tuple[str, ...] = (),
) -> xr.Dataset:  # fmt: skip
    """Dataset of a sequence of equilibria, including its case.

    Parameters
    ----------
    case : Case
        Case that was loaded.
    load_factor : array_like, shape (ns,)
        Load factor of each point.
    displacement : array_like, shape (ns, n, 3)
        Displacement (m) of every node.
    reaction : array_like, shape (ns, nd)
        Forces of the supports (N) on the dofs in `case.reaction_dofs`, in this order.
    energies : mapping of str to array_like, shape (ns,)
        Work and the strain energies in the structure's `energy_groups` (J).
    solution : mapping of str to array_like, shape (ns,)
        How each point was found: negative_eigenvalues (-1 if not counted), point ("regular",
        "limit" or "bifurcation"), iterations, residual.
    statistics : mapping
        Facts about the run, each stored as an attribute.
    obstacles : tuple of str
        Reasons why the path cannot be rerun from the dataset, in addition to those in the case.

    Returns
    -------
    xarray.Dataset
        As from `trajectory_dataset`, with the dimension step and the coordinate `load_factor`.
    """
    factor = np.array(load_factor, dtype=np.float64)
    kinds = np.array(solution["point"], dtype="<U11")  # the longest value is "bifurcation"
    values = {"displacement": displacement, "reaction": reaction, **energies, **solution}
    data = variables({**quantities.PATH, **energies_of(case)}, "step", values | {"point": kinds})
    along = {"load_factor": ("step", factor, {"long_name": "load factor"})}
    return result_dataset("path", case, data, along, statistics, None, obstacles)


def modes_dataset(
    case: Case, values: Mapping[str, ArrayLike], statistics: Mapping[str, Any]
) -> xr.Dataset:
    """Dataset of modes about a state, including its case.

    Parameters
    ----------
    case : Case
        Case that vibrates.
    values : mapping of str to array_like
        Variables of `quantities.MODES`, optionally of `quantities.INTERNAL`, and the
        `displacement` (n, 3) of the state, m.
    statistics : mapping
        Facts about the computation, each stored as an attribute.

    Returns
    -------
    xarray.Dataset
        The variables, with the coordinate `mode` = 1, 2, ..., and the case as from
        `trajectory_dataset`.
    """
    internal = {name: own for name, own in quantities.INTERNAL.items() if name in values}
    known = {**quantities.MODES, **internal}
    data = variables(known, "mode", {name: values[name] for name in known})
    text = "displacement of the state from the rest position"
    data["displacement"] = variable(PLACE, values["displacement"], "m", text)
    if "between_position" in values:
        where, text = values["between_position"], "rest position of the points between nodes"
        data["between_position"] = variable(("between", "axis"), where, "m", text)
    return result_dataset("modes", case, data, _numbered(values["frequency"]), statistics)


def buckling_dataset(
    case: Case, values: Mapping[str, ArrayLike], statistics: Mapping[str, Any]
) -> xr.Dataset:
    """Dataset of load factors and buckling shapes, including its case.

    Parameters
    ----------
    case : Case
        Case that buckles.
    values : mapping of str to array_like
        Variables of `quantities.BUCKLING`, the `displacement` (n, 3) of the base state, m, and the
        displacement `prebuckling` (n, 3) per unit of the load factor, m.
    statistics : mapping
        Facts about the computation, each stored as an attribute.

    Returns
    -------
    xarray.Dataset
        As from `modes_dataset`.
    """
    own = {name: values[name] for name in quantities.BUCKLING}
    data = variables(quantities.BUCKLING, "mode", own)
    text = "displacement of the base state from the rest position"
    data["displacement"] = variable(PLACE, values["displacement"], "m", text)
    text = "displacement per unit of the load factor from the base state"
    data["prebuckling"] = variable(PLACE, values["prebuckling"], "m", text)
    return result_dataset("buckling", case, data, _numbered(values["load_factor"]), statistics)


def _numbered(modes: ArrayLike, text: str = "mode") -> dict[str, Any]:
    """Coordinate of the numbers of modes, from 1."""
    return {"mode": ("mode", 1 + np.arange(len(np.asarray(modes))), {"long_name": text})}


def frf_dataset(
    case: Case, frequency: ArrayLike, quantity: str, response: ArrayLike, displacement: ArrayLike,
    drive: ArrayLike, statistics: Mapping[str, Any], more: Mapping[str, ArrayLike] | None = None,
) -> xr.Dataset:  # fmt: skip
    """Dataset of a frequency response, including its case.

    Parameters
    ----------
    case : Case
        The case that responds, without the drive.
    frequency : array_like, shape (m,)
        Frequencies (Hz).
    quantity : {"receptance", "transmissibility"}
        Kind of the response.
    response : array_like, shape (m, n, 3), complex
        Response of every node, for motions in time as exp(+i w t).
    displacement : array_like, shape (n, 3)
        Displacement (m) of the state about which the case moves.
    drive : array_like, shape (n, 3)
        Amplitudes of the forces on the nodes (N), or of the displacement of the base (m).
    statistics : mapping
        Facts about the run, each stored as an attribute.
    more : mapping of str to array_like, optional
        Further variables, from `quantities.ESTIMATES`.

    Returns
    -------
    xarray.Dataset
        The response under its own name, complex (frequency, node, axis), `displacement` and
        `drive` (node, axis), and the variables that every result has.
    """
    values = {quantity: np.asarray(response, np.complex128), **(more or {})}
    data = variables({**quantities.RESPONSES, **quantities.ESTIMATES}, "frequency", values)
    driven = "N" if quantity == "receptance" else "m"
    data["displacement"] = variable(PLACE, displacement, "m", "displacement of the state")
    data["drive"] = variable(PLACE, drive, driven, "amplitude of the drive")
    along = {"frequency": ("frequency", np.array(frequency, float), {"units": "Hz"})}
    return result_dataset("frf", case, data, along, statistics)


def random_dataset(
    case: Case, place: ArrayLike, found: Mapping[str, Mapping[str, NDArray]],
    statistics: Mapping[str, Any], frequency: NDArray, points: Mapping[str, Any],
    of: str = "random",
) -> xr.Dataset:  # fmt: skip
    """Dataset of a response to a random base or to a shock, including its case.

    Parameters
    ----------
    case : Case
        The case that responds, without the drives.
    place : array_like, shape (n, 3)
        Displacement (m) of the state about which the case moves.
    found : mapping
        Of each quantity in `quantities.RANDOM`, its `STATISTICS`, whose last dimension has all
        parts.
    statistics : mapping
        Facts about the run, each stored as an attribute.
    frequency : (nf,)
        Frequencies (Hz) of densities; none without these.
    points : mapping
        Coordinates of the points of stresses.
    of : {"random", "spectrum"}
        Kind of the result.
    """
    data = {"displacement": variable(PLACE, place, "m", "displacement of the state")}
    sizes = {
        "node": len(case.structure.nodes), "axis": 3, "support": len(case.reaction_dofs),
        "component": 3, "face": 2, "crease": len(case.structure.pattern.creases), "point": -1,
    }  # fmt: skip
    for name, parts in found.items():
        own = quantities.RANDOM[name]
        shape = [sizes[dim] for dim in own.dims]
        for kind, value in parts.items():
            unit, text, along = quantities.STATISTICS[kind]
            data[f"{name}_{kind}"] = variable(
                (*along, *own.dims), value.reshape(*value.shape[:-1], *shape),
                unit.format(f"({own.units})" if "/" in own.units else own.units),
                text.format(own.text),
            )  # fmt: skip
    coordinates: dict[str, Any] = dict(points)
    if len(frequency):
        coordinates["frequency"] = ("frequency", frequency, {"units": "Hz"})
    return result_dataset(of, case, data, coordinates, statistics)


def fidelity_dataset(
    case: Case, models: Sequence[str], values: Mapping[str, ArrayLike],
    statistics: Mapping[str, Any],
) -> xr.Dataset:  # fmt: skip
    """Dataset of a comparison of models with superelements or the shell, including its case.

    Parameters
    ----------
    case : Case
        Case that was compared, with its own model.
    models : sequence of str
        Names of the models.
    values : mapping of str to array_like
        Variables of `quantities.FIDELITY`.
    statistics : mapping
        Facts about the comparison, each stored as an attribute.
    """
    data = variables(quantities.FIDELITY, (), values)
    along = _numbered(values["frequency"], "elastic mode of the reference")
    along["model"] = ("model", np.array(list(models)), {"long_name": "model"})
    return result_dataset("fidelity", case, data, along, statistics)


def folding_dataset(
    pattern: Pattern, share: ArrayLike, values: Mapping[str, ArrayLike],
    statistics: Mapping[str, Any],
) -> xr.Dataset:  # fmt: skip
    """Dataset of the states of a folding pattern, including the pattern.

    Parameters
    ----------
    pattern : Pattern
        Pattern that is folded.
    share : array_like, shape (ns,)
        Position of each state along the folding motion, from 0 to 1.
    values : mapping of str to array_like
        Variables of `quantities.FOLDING`.
    statistics : mapping
        Facts about the folding, each stored as an attribute.

    Returns
    -------
    xarray.Dataset
        The variables along the dimension step, and the pattern as from `trajectory_dataset`;
        without a sheet there is no case to rebuild.
    """
    document = pattern_document(pattern)
    coordinates = {
        "step": np.arange(len(np.asarray(share))),
        "share": ("step", np.array(share, float), {"long_name": "share of the way"}),
        "node": np.arange(len(pattern.vertices)),
        "axis": AXIS,
        "crease_vertices": (("crease", "end"), pattern.creases),
    }
    data = variables(quantities.FOLDING, "step", values)
    attributes = own_attributes("folding", document.obstacles) | facts(statistics)
    return xr.Dataset({**data, **case_variables(document)}, coordinates, attributes)


def result_dataset(
    kind: str, case: Case, data: Mapping[str, Any], along: Mapping[str, Any],
    statistics: Mapping[str, Any], times: NDArray[np.float64] | None = None,
    obstacles: tuple[str, ...] = (),
) -> xr.Dataset:  # fmt: skip
    """Dataset of a result: variables, the case, and facts about the run.

    Parameters
    ----------
    kind : str
        Value of the attribute `foldyn_result`.
    case : Case
    data, along : mapping
        Variables, and the coordinates of the dimension along which the result runs.
    statistics : mapping
        Facts about the run.
    times : ndarray, optional
        Times (s) at which functions of time are sampled.
    obstacles : tuple of str
        Reasons why the result cannot be rerun from the dataset, in addition to those in the case.
    """
    support = case.reaction_dofs
    document = to_document(case, times)
    attributes = own_attributes(kind, (*document.obstacles, *obstacles)) | facts(statistics)
    coordinates = {
        **along,
        "node": np.arange(len(case.structure.nodes)),
        "axis": AXIS,
        "support_node": ("support", support // 3),
        "support_axis": ("support", AXIS[support % 3]),
    }
    reasoned = {name: with_reason(name, values) for name, values in data.items()}
    return xr.Dataset({**reasoned, **case_variables(document)}, coordinates, attributes)


def stage_times(statistics: Mapping[str, Any]) -> NDArray[np.float64] | None:
    """Return t_n = start + n dt and t_n + dt/2 of a run from `start`, `dt` (s) and `steps`."""
    dt, steps = statistics.get("dt"), statistics.get("steps")
    if dt is None or steps is None or int(steps) < 1:
        return None
    steps, dt = int(steps), float(dt)
    times = np.empty(2 * steps + 1)
    times[::2] = float(statistics.get("start", 0.0)) + np.arange(steps + 1) * dt
    times[1::2] = times[:-1:2] + 0.5 * dt
    return times


def periodic_dataset(
    case: Case, time: ArrayLike, motion: Mapping[str, ArrayLike], coefficient: NDArray,
    floquet: ArrayLike, stable: bool, periods: int, statistics: Mapping[str, Any],
    origin: Origin | None = None,
) -> xr.Dataset:  # fmt: skip
    """Dataset of one periodic motion, including its case.

    Parameters
    ----------
    case : Case
    time : array_like, shape (nt,)
        Times (s) over one period.
    motion : mapping of str to array_like, shape (nt, n, 3)
        Displacement (m) and velocity (m/s).
    coefficient : ndarray, complex, shape (h + 1, n, 3)
        Amplitudes of exp(2 pi i j t / period), m.
    floquet : array_like, complex, shape (r,)
    stable : bool
    periods : int
        Number of drive periods per period of the motion.
    statistics : mapping
        Facts about the computation, each stored as an attribute.
    origin : Origin, optional
        Reference state of damping.
    """
    data = variables(quantities.MOTION, "time", motion)
    data |= {} if origin is None else origin_variables(origin)
    single = {"coefficient": coefficient, "stable": stable, "periods": periods, "floquet": floquet}
    data |= variables(quantities.POINTS, (), single)
    along = {
        "time": ("time", np.asarray(time, float), {"units": "s"}),
        "harmonic": ("harmonic", np.arange(len(coefficient)), {"long_name": "harmonic"}),
    }
    return result_dataset("periodic_motion", case, data, along, statistics)


def points_dataset(
    kind: str, case: Case, values: Mapping[str, ArrayLike], statistics: Mapping[str, Any],
    units: str = "m", origin: Origin | None = None,
) -> xr.Dataset:  # fmt: skip
    """Dataset of the points of a response curve or a backbone, including its case.

    Parameters
    ----------
    kind : {"response_curve", "backbone"}
    case : Case
    values : mapping of str to array_like, shape (points, ...)
        Variables of `POINTS`, of which `frequency` is a coordinate.
    statistics : mapping
        Facts about the computation, each stored as an attribute.
    units : str
        Unit of the amplitude.
    origin : Origin, optional
        See `periodic_dataset`.
    """
    size = quantities.POINTS["amplitude"]._replace(units=units)
    if kind == "backbone":
        size = size._replace(text="largest displacement of any node from the equilibrium")
    known = {**quantities.POINTS, "amplitude": size}
    data = variables(known, "point", {k: v for k, v in values.items() if k != "frequency"})
    data |= {} if origin is None else origin_variables(origin)
    text = "frequency of the motion" if kind == "backbone" else quantities.POINTS["frequency"].text
    frequency = np.asarray(values["frequency"], float)
    along: dict[str, Any] = {
        "frequency": ("point", frequency, {"units": "Hz", "long_name": text}),
        "point": ("point", np.arange(len(frequency)), {"long_name": "point"}),
    }
    if "coefficient" in values:
        count = np.asarray(values["coefficient"]).shape[1]
        along["harmonic"] = ("harmonic", np.arange(count), {"long_name": "harmonic"})
    return result_dataset(kind, case, data, along, statistics)
