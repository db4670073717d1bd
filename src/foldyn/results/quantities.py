"""Registry of result variables: unit, meaning and dimensions of each variable.

Users can add a quantity that is a function of the state to a motion:
``simulate(..., sample={"tip": Quantity("m", "height of the tip", function=height)})``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from foldyn.results.columns import pieces_of


class Quantity(NamedTuple):
    """A variable of a result.

    Parameters
    ----------
    units : str
        Unit, such as "m/s"; "1" or empty if dimensionless.
    text : str
        Meaning, as shown in labels of figures.
    dims : tuple of str
        Dimensions such as "node" or "axis", in addition to those of the result, such as time.
    function : callable, optional
        Function of displacement (n, 3), m, velocity (n, 3), m/s, and time, s, that returns the
        value, a number or an array with these dimensions. Built-in quantities need none.
    """

    units: str = ""
    text: str = ""
    dims: tuple[str, ...] = ()
    function: Callable[[NDArray, NDArray, float], ArrayLike] | None = None


PLACE = ("node", "axis")
BRANCH = ("branch", "variable")

MEMORY = Quantity("rad", "state of the branches of laws with memory", BRANCH)
STATE = {
    "displacement": Quantity("m", "displacement from the rest position", PLACE),
    "reaction": Quantity("N", "force of the support", ("support",)),
}
CONTACT = {
    "contact_force": Quantity("N", "force of contact on each node, without friction", ("node",)),
    "plane_force": Quantity(
        "N", "force of each plane on the sheet, without friction", ("plane", "axis")
    ),
}
"""Variables of motions and paths with contact; `plane_force` only with planes."""
TENSION = Quantity("N", "tension of springs, bars and cables", ("line",))
MOTION: Mapping[str, Quantity] = STATE | {
    "velocity": Quantity("m/s", "velocity", PLACE),
    "kinetic": Quantity("J", "kinetic energy"),
    "dissipated": Quantity("J", "energy dissipated by damping since the start"),
    "air": Quantity("J", "energy lost to the air since the start"),
    "work": Quantity("J", "work of the loads since the start"),
    "memory": MEMORY,
}
CONTINUATIONS: Mapping[str, str] = {
    "continuation": "further state of the method, to continue from the last sample",
    "continued_from": "further state of the method from another motion, at the first sample",
}
"""Further variables of motions whose samples do not hold all dofs, along `continued`."""
ORIGIN: Mapping[str, Quantity] = {
    "origin": Quantity("m", "displacement of the state that damping refers to", PLACE),
    "origin_time": Quantity("s", "time of that state; nan: it is under the constant loads alone"),
    "flow": Quantity("m", "displacement at which the flow was last computed", PLACE),
    "flow_time": Quantity("s", "time at which the motion uses that flow"),
    "flow_looked": Quantity(text="steps from the last check of that flow to that time"),
}
"""Further variables of motions whose damping or added mass depends on the initial state."""
SINCE = "since rest, or since the state from which a path was started"
PATH: Mapping[str, Quantity] = {
    **STATE,
    **CONTACT,
    "tension": TENSION,
    "plane_friction": Quantity("N", "friction of each plane on the sheet", ("plane", "axis")),
    "work": Quantity("J", f"work of loads, supports and actuators {SINCE}"),
    "negative_eigenvalues": Quantity(text="negative eigenvalues of the tangent (unstable if any)"),
    "point": Quantity(text="kind of the point"),
    "interval": Quantity(text="load factors between which the critical point lies", dims=("end",)),
    "iterations": Quantity(text="Newton iterations"),
    "residual": Quantity(text="residual as a fraction of the forces at play"),
    "memory": MEMORY,
    "dissipated": Quantity("J", f"energy dissipated by creases and friction {SINCE}"),
    "elapsed": Quantity("s", "time since the first point"),
}
HARMONICS = ("harmonic", *PLACE)
POINTS: Mapping[str, Quantity] = {
    "frequency": Quantity("Hz", "frequency of the drive"),
    "level": Quantity("1", "factor on the drive"),
    "amplitude": Quantity("m", "half the distance between the extremes"),
    "stable": Quantity(text="whether the motion is stable"),
    "bifurcation": Quantity(text="bifurcation at the point"),
    "branch": Quantity(text="number of the branch"),
    "periods": Quantity("1", "periods of the drive per period of the motion"),
    "floquet": Quantity("1", "Floquet multiplier", ("multiplier",)),
    "coefficient": Quantity("m", "complex amplitude of a harmonic of the motion", HARMONICS),
    "truncation": Quantity("1", "estimated effect of twice as many harmonics"),
    "reduction": Quantity("1", "estimated effect of the dofs left out"),
    "energy": Quantity("J", "energy above the energy at rest"),
    "energy_drift": Quantity("1", "largest change of the energy along the motion"),
}
"""Possible variables of points of a response curve or a backbone, along the dimension point."""
FOLDING: Mapping[str, Quantity] = {
    "displacement": Quantity("m", "displacement from the initial pattern", PLACE),
    "position": Quantity("m", "position of the vertex", PLACE),
    "fold_angle": Quantity("rad", "fold angle, valleys positive", ("crease",)),
    "strain": Quantity(text="largest strain of a bar"),
    "bend": Quantity("rad", "largest turn of a bend within a panel"),
}
CROSSINGS: Mapping[str, Quantity] = {
    "crossing_panels": Quantity(text="panels that pass through each other", dims=("two",)),
    "crossing_first": Quantity(text="first checked sample (from 0) in which the two panels cross"),
}
"""Further variables of motions and paths with crossing panels, along the dimension crossing."""
MODES: Mapping[str, Quantity] = {
    "frequency": Quantity("Hz", "frequency"),
    "eigenvalue": Quantity("rad2/s2", "square of the angular frequency (negative: unstable)"),
    "shape": Quantity("m", "mode shape with the modal mass 1 kg m2", PLACE),
    "rigid": Quantity("1", "whether the mode is a rigid motion that nothing resists"),
    "rigid_share": Quantity("1", "share of the shape in the space of rigid motions"),
    "damping_ratio": Quantity("1", "modal damping ratio"),
    "participation": Quantity("kg m", "participation factor", ("axis",)),
    "effective_mass": Quantity("kg", "effective mass", ("axis",)),
}
INTERNAL: Mapping[str, Quantity] = {
    "frequency_error": Quantity("Hz", "estimate of the largest error of the frequency"),
    "model_error": Quantity("1", "error of the frequency, by comparison with superelements"),
    "air_share": Quantity("1", "share of the air in the modal mass"),
    "between_shape": Quantity("m", "mode shape between nodes", ("between", "axis")),
}
"""Further variables of modes, of some models or in air. The dimension `between` counts the
middles of edges and spokes, panel by panel."""
STRESSES: Mapping[str, Quantity] = {
    "membrane_force": Quantity("N/m", "membrane force", ("point", "component")),
    "bending_moment": Quantity(
        "N", "moment per length, positive if the front is stretched", ("point", "component")
    ),
    "stress": Quantity("Pa", "stress at the faces", ("point", "face", "component")),
    "von_mises": Quantity("Pa", "von Mises stress", ("point", "face")),
    "principal_stress": Quantity(
        "Pa", "largest and smallest principal stress", ("point", "face", "principal")
    ),
    "crease_moment": Quantity(
        "N", "moment of the crease per length, positive if it is too far open", ("crease",)
    ),
}
"""Variables of stresses, in addition along the states of a result."""
RANDOM: Mapping[str, Quantity] = {
    "displacement": Quantity("m", "displacement, relative to the base", PLACE),
    "acceleration": Quantity("m/s2", "absolute acceleration", PLACE),
    "reaction": Quantity("N", "force of the support", ("support",)),
    "total_reaction": Quantity("N", "sum of the forces of the supports", ("axis",)),
    **{name: STRESSES[name] for name in ("membrane_force", "bending_moment", "von_mises")},
    "crease_moment": STRESSES["crease_moment"],
}
"""What responds to a random base or a shock, with its unit; of each there are"""
STATISTICS: Mapping[str, tuple[str, str, tuple[str, ...]]] = {
    "rms": ("{}", "root mean square: {}", ()),
    "peak": ("{}", "largest value in a shock: {}", ()),
    "crossings": ("Hz", "zero crossings, rising: {}", ()),
    "psd": ("{}2/Hz", "one-sided spectral density: {}", ("frequency",)),
    "cumulative": ("{}", "root mean square of the part below the frequency: {}", ("frequency",)),
}
"""variables of the form "displacement_rms": unit, text and further dimensions."""
MARGINS: Mapping[str, Quantity] = {
    "panel_margin": Quantity("1", "least margin of safety of the panel", ("panel",)),
    "panel_point": Quantity(text="point of the stresses at which it is least", dims=("panel",)),
    "panel_state": Quantity(text="load factor or time (s) at which it is least", dims=("panel",)),
    "crease_margin": Quantity("1", "least margin of safety of the crease", ("crease",)),
    "crease_state": Quantity(text="load factor or time (s) at which it is least", dims=("crease",)),
}
BUCKLING: Mapping[str, Quantity] = {
    "load_factor": Quantity("1", "load factor (negative: loads reversed)"),
    "shape": Quantity("m", "buckling shape with the largest displacement 1 m", PLACE),
}
RESPONSES: Mapping[str, Quantity] = {
    "receptance": Quantity("m/N", "displacement per force", PLACE),
    "mobility": Quantity("m/(N s)", "velocity per force", PLACE),
    "accelerance": Quantity("m/(N s2)", "acceleration per force", PLACE),
    "transmissibility": Quantity("1", "displacement per displacement of the base", PLACE),
}
"""Variables of a frequency response: one of these,"""
ESTIMATES: Mapping[str, Quantity] = {
    "coherence": Quantity("1", "coherence", PLACE),
    "swing": Quantity("rad", "largest amplitude of a superlinear hinge"),
    "unsteadiness": Quantity("1", "relative error that transients leave, estimated"),
}
"""and those that the method adds."""
WAVE = ("phase", "band")
BANDS: Mapping[str, Quantity] = {
    "frequency": Quantity("Hz", "frequency", WAVE),
    "frequency_error": INTERNAL["frequency_error"]._replace(dims=WAVE),
    "model_error": INTERNAL["model_error"]._replace(dims=WAVE),
    "eigenvalue": MODES["eigenvalue"]._replace(dims=WAVE),
    "group_velocity": Quantity("m/s", "group velocity", (*WAVE, "axis")),
    "polarization": Quantity("1", "share of the direction in the kinetic energy", (*WAVE, "axis")),
    "shape": Quantity("m", "Bloch mode with the modal mass 1 kg m2 in a cell", (*WAVE, *PLACE)),
    "position": Quantity("m", "position in the state", PLACE),
    "displacement": Quantity("m", "displacement of the state from the rest position", PLACE),
    "residual": Quantity("1", "residual of the state as a fraction of the forces at play"),
    "vectors": Quantity("m", "shift from one cell to the next", ("period", "axis")),
    "angles": Quantity("rad", "turn from one cell to the next", ("period",)),
    "axes": Quantity("1", "axis of the turn", ("period", "axis")),
    "points": Quantity("m", "point on the axis of the turn", ("period", "axis")),
    "zone_frequency": Quantity("Hz", "frequency in the whole zone", ("zone", "band")),
    "damped_frequency": Quantity("Hz", "frequency of the damped wave", WAVE),
    "damped_ratio": Quantity("1", "damping ratio of the wave", WAVE),
    "attenuation": Quantity("Np", "attenuation from cell to cell", ("leg", "level")),
    "level_frequency": Quantity("Hz", "frequency of the attenuation", ("level",)),
}
"""Variables of bands; if there are several states, also along the dimension `state`."""
GAPS: Mapping[str, Quantity] = {
    "gap_state": Quantity(text="number of the state, from 0"),
    "gap_direction": Quantity(text="part of the path along which no wave travels, or all"),
    "gap_below": Quantity(text="number of the band below (0: none)"),
    "gap_bottom": Quantity("Hz", "bottom of the gap"),
    "gap_top": Quantity("Hz", "top of the gap"),
    "gap_width": Quantity("Hz", "width of the gap"),
    "gap_relative_width": Quantity("1", "width of the gap divided by its middle frequency"),
}
"""Further variables of bands along the dimension `gap`."""
FIDELITY: Mapping[str, Quantity] = {
    "frequency": Quantity("Hz", "frequency of the reference", ("mode",)),
    "mesh_error": Quantity("1", "error of the finest mesh (nan: not converged)", ("mode",)),
    "error": Quantity("1", "error of a frequency (infinite: lost)", ("mode", "model")),
    "mac": Quantity("1", "MAC with the mode of the reference", ("mode", "model")),
    "options": Quantity(text="arguments of discretize", dims=("model",)),
    "soft_hinges": Quantity(text="hinges without stiffness at rest", dims=("model",)),
    "deflection": Quantity("m", "displacement of the reference along small loads"),
    "deflection_mesh_error": Quantity("1", "error of the finest mesh (nan: not converged)"),
    "deflection_error": Quantity("1", "error of the displacement (infinite: soft)", ("model",)),
}
"""Variables of a comparison of models with superelements or the shell; the last three only if there
are forces."""


def variables(
    known: Mapping[str, Quantity], along: str | tuple[str, ...], values: Mapping[str, ArrayLike]
) -> dict[str, Any]:
    """Dataset variables from values along any number of dimensions."""
    first = (along,) if isinstance(along, str) else along
    return {
        name: variable((*first, *known[name].dims), array, known[name].units, known[name].text)
        for name, array in values.items()
    }


def variable(dims: tuple[str, ...], values: ArrayLike, units: str, text: str) -> tuple:
    """Dataset variable with a label for figures, and the unit if there is one."""
    attributes = {"units": units, "long_name": text}
    return dims, np.asarray(values), {key: word for key, word in attributes.items() if word}


def energies_of(case: Any) -> dict[str, Quantity]:
    """Strain energies of a case's structure, for each energy group."""
    return {name: Quantity("J", text) for name, text in case.energy_groups.items()}


REASONS: Mapping[str, str] = {
    "frequency": "an unstable mode grows instead of oscillating",
    "zone_frequency": "an unstable wave grows instead of oscillating",
    "damped_ratio": "a rigid motion does not oscillate",
    "slope": "bands have corners where the frequency is zero",
    "group_velocity": "bands have corners where the frequency is zero",
    "model_error": "rigid modes, what superelements lack, and entries near 0 are not compared",
    "damping_ratio": "a rigid or an unstable mode does not oscillate",
    "receptance": "a resonance without damping, a body free to move at 0 Hz, or no convergence",
    "transmissibility": "a resonance without damping, or no convergence",
    "coherence": "without a response (held axes, nodes at rest) coherence is undefined",
    "swing": "the harmonic balance does not converge at the frequency",
    "mesh_error": "the meshes of the shell have not converged",
    "deflection_mesh_error": "the meshes of the shell have not converged",
    **{
        f"{of}{name}": "several mean strains cost no energy"
        for of in ("", "bending_")
        for name in ("modulus", "modulus_along", "poissons_ratio")
    },
    "shear_modulus": "several mean strains cost no energy",
    "twisting_modulus": "several mean strains cost no energy",
}
"""Variables that may lack values, and the reasons."""
UNEXPECTED = "the computation was no longer finite"


def with_reason(name: str, variable: tuple) -> tuple:
    """Add the reason for missing values, if any, to a variable (dimensions, values, attributes)."""
    dimensions, values, attributes = variable
    if not _missing(values):
        return variable
    return dimensions, values, {**attributes, "missing": REASONS.get(name, UNEXPECTED)}


def _missing(values: Any) -> int:
    """Number of missing values."""
    values = np.asarray(values)
    return int(np.isnan(values).sum()) if values.dtype.kind in "fc" else 0


def missing_values(ds: xr.Dataset) -> dict[str, str]:
    """For each incomplete variable, by name, say how many values are missing and why."""
    found = {}
    for name, one in ds.data_vars.items():
        count = sum(map(_missing, pieces_of(one.variable))) if one.dtype.kind in "fc" else 0
        if count:
            why = one.attrs.get("missing", UNEXPECTED)
            found[str(name)] = f"{count} of {one.size} values are missing (nan): {why}"
    return found
