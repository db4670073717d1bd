"""Calibration of the paper's specimen: folds from the static test, damping from the release."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from numpy.typing import NDArray

from foldyn import experiment
from foldyn.analyses import CaseFile
from foldyn.analyses.keys import replaced
from foldyn.analyses.reading import case_of_document, read_document
from foldyn.results import save
from foldyn.statics import Settings
from foldyn.studies import find_case
from foldyn.writing import write_text

FOLDS = {"sheet.length_scale_ratio": 2.7, "model.fold_law.theta1": 75.0}
# Damping found in the paper, and the truth behind the synthetic data.
DAMPING = {"damping.alpha": 14.4, "damping.beta": 4.1e-4}
MIRRORED = {"model.fold_law.theta2": "360 - model.fold_law.theta1"}
FOLD_RANGES = (
    experiment.Parameter("sheet.length_scale_ratio", 2.0, 0.5, 10.0),
    experiment.Parameter("model.fold_law.theta1", 65.0, 45.0, 100.0),
)
DAMPING_RANGES = (
    experiment.Parameter("damping.alpha", 10.0, 0.0, 40.0),
    experiment.Parameter("damping.beta", 2e-4, 0.0, 2e-3),
)
FULL = 0.056  # m, displacement of the top in the shipped case
WEIGHTS = (0.125, 0.226, 0.312)  # N
TOP = tuple(range(7))
WATCHED = 8  # the paper's node 9
# Nodes that a camera in front of the specimen sees, without the bottom row, which does not move.
FRONT = tuple(7 * i + j for i in range(8) for j in (1, 3, 5))
SYNTHETIC = "synthetic"
FORCE_ERROR = 2e-4  # N: a scale that reads to 0.02 g
BAND = (2.0, 40.0)  # Hz: band of compared spectra
SEEN = 0.6  # s: length of the decaying free vibration
IN_AIR = {"air.density": 1.204}  # kg/m3
STEP = 0.001  # s: step of the simulation
BOTTOM = list(range(56, 63))
# Supports of the bottom: a smooth plate (ideal, as in the static test); the plate with node 59
# glued to it, as in the paper's text; the glue alone, without a plate.
SUPPORTS: Mapping[str, list[dict[str, Any]]] = {
    "plate": [
        {"nodes": BOTTOM, "axes": "x"},
        {"nodes": [59], "axes": "y"},
        {"nodes": [57, 59, 61], "axes": "z"},
    ],
    "glued": [{"nodes": BOTTOM, "axes": "x"}, {"nodes": [59], "axes": "yz"}],
    "glue alone": [{"nodes": [59], "axes": "xyz"}],
}
# Displacement of the top before the release (m).
#
# Released from the 20 mm of the smallest weight, the sheet would not swing with this damping: K0 is
# the stiffness at rest throughout, and resists the large rotations of the panels.
PRESSED = 0.005


def pressed(factors: Sequence[float] | NDArray, changes: Mapping[str, Any] | None = None) -> Any:
    """Path of the specimen while its top is pressed down to fractions of 56 mm."""
    at = {"method": "newton", "load_factors": list(factors)}
    return shipped("specimen", changes).run(settings=Settings(stability=False), **at)


def shipped(name: str, changes: Mapping[str, Any] | None = None) -> CaseFile:
    """A shipped case file ("specimen", "specimen-frf", ...) with other values of some keys."""
    path = find_case(f"herkal/{name}")
    return case_of_document(path, replaced(read_document(path), changes or {}))


def force_on_top(path: Any) -> NDArray[np.float64]:
    """Force (N) that presses the top, at each step of a path."""
    top = np.isin(path["support_node"].values, TOP) & (path["support_axis"].values == "x")
    return path["reaction"].values[:, top].sum(axis=1)


def weighed(changes: Mapping[str, Any] | None = None) -> NDArray[np.float64]:
    """Load factors at which the specimen carries the three weights."""
    factors = np.linspace(0.0, 1.0, 29)
    found = np.interp(WEIGHTS, force_on_top(pressed(factors, changes)), factors)
    for _ in range(3):  # secant method
        near = force_on_top(pressed(np.sort([*found, *(found + 1e-3)]), changes))
        slope = (near[1::2] - near[::2]) / 1e-3
        found = found - (near[::2] - WEIGHTS) / slope
    return found


def released_case(
    folder: Path,
    changes: Mapping[str, Any] | None = None,
    step: float = STEP,
    press: float = PRESSED,
    support: str = "plate",
    duration: float = SEEN,
) -> Path:
    """Case file of the free vibration after the top was pressed down and released.

    The motion starts from the equilibrium on the smooth plate with this displacement of the top.

    Parameters
    ----------
    folder : Path
        Receives the case file and its initial state; created if missing.
    changes : mapping, optional
        Values found by the static calibration, by key.
    step : float
        Time step of the simulation (s).
    press : float
        Displacement of the top (m).
    support : str
        One of `SUPPORTS`.
    duration : float
        Duration of the motion (s).
    """
    folder.mkdir(parents=True, exist_ok=True)
    save(pressed([press / FULL], changes), folder / "pressed.nc")
    document = replaced(read_document(find_case("herkal/specimen-release")), changes or {})
    del document["loads"]
    motion = {"kind": "dynamics", "method": "generalized_alpha", "dt": step, "duration": duration}
    document |= {
        "title": "The paper specimen released",
        "supports": SUPPORTS[support],
        "initial": {"file": "pressed.nc"},
        "damping": {key.removeprefix("damping."): value for key, value in DAMPING.items()},
        "analysis": motion,
        "output": {"nodes": [WATCHED], "axis": "x", "interval": step},
    }
    path = folder / "released.toml"
    write_text(tomli_w.dumps(document), path)
    return path


def fit_folds(static: Sequence[experiment.Measurement], **options: Any) -> experiment.Fit:
    """Fit the length-scale ratio and theta1 = 360 - theta2 to a static test."""
    case = find_case("herkal/specimen")
    return experiment.fit(case, static, parameters=FOLD_RANGES, ties=MIRRORED, **options)


def changes_of(folds: experiment.Fit) -> dict[str, Any]:
    """Values that a fit of the folds changes in a case file, by key."""
    return folds.problem.space.changes([*folds.values.values()])


def fit_damping(
    case: Path, film: Sequence[experiment.Measurement], **options: Any
) -> experiment.Fit:
    """Fit alpha and beta to a release."""
    return experiment.fit(case, film, parameters=DAMPING_RANGES, **options)


def spectra_of(film: Sequence[experiment.Measurement]) -> list[experiment.Spectrum]:
    """Spectra of the histories without missing samples, held out."""
    return [
        experiment.Spectrum.of(replace(one, held_out=True, name=f"{one.name}, frequencies"), BAND)
        for one in film
        if isinstance(one, experiment.TimeHistory) and np.isfinite(one.values).all()
    ]
