"""Calibration of the paper's specimen: folds from the static test, damping from the release.

The paper's raw data are not public. `static_data` and `release_data` are computed by the same model
with the paper's parameters (no model error), and `noisy` adds the errors of a camera and of scales.
`python -m foldyn.studies.herkal.calibration FOLDER` fits both and draws them (a few minutes).
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from foldyn import experiment
from foldyn.analyses import CaseFile, read_case
from foldyn.analyses.keys import replaced
from foldyn.analyses.reading import case_of_document, read_document
from foldyn.experiment.calibration.fit_page import write_fit
from foldyn.results import save
from foldyn.signals import matrix_pencil
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
STATIC_ERROR = 5e-5  # m: a corner in a photograph
FILM_ERROR = 1e-5  # m: 0.3 pixels of a picture with 4032 pixels over 0.13 m
RATE = 240.0  # frames per second
BAND = (2.0, 40.0)  # Hz: band of compared spectra
TURNED = 0.05  # s from the release to the first turning point
SEEN = 0.6  # s: length of the decaying free vibration
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


def static_data() -> list[experiment.Measurement]:
    """Forces at the displacements under the three weights, and positions of the front nodes."""
    factors = weighed()
    path = pressed(factors)
    free = FRONT[3:]  # the displacement of the top is imposed
    return [
        experiment.ForceDisplacement(
            nodes=TOP, displacement=FULL * factors, force=force_on_top(path),
            sigma=FORCE_ERROR, name="weights", label=SYNTHETIC,
        ),
        experiment.Shapes(
            nodes=free, load_factor=factors, values=path["displacement"].values[:, free],
            sigma=STATIC_ERROR, name="front corners", label=SYNTHETIC,
        ),
    ]  # fmt: skip


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
    document |= {
        "title": "The paper specimen released",
        "supports": SUPPORTS[support],
        "initial": {"file": "pressed.nc"},
        "damping": {key.removeprefix("damping."): value for key, value in DAMPING.items()},
        "analysis": {
            "kind": "dynamics",
            "method": "generalized_alpha",
            "dt": step,
            "duration": duration,
        },
        "output": {"nodes": [WATCHED], "axis": "x", "interval": step},
    }
    path = folder / "released.toml"
    write_text(tomli_w.dumps(document), path)
    return path


def release_data(case: Path) -> list[experiment.Measurement]:
    """Histories of node 8 and, held out, of all other front nodes, sampled like a film."""
    motion = read_case(case).run()
    time = np.arange(0.0, SEEN, 1.0 / RATE)
    along = motion["displacement"].sel(axis="x")
    others = tuple(node for node in FRONT if node != WATCHED)
    return [
        experiment.TimeHistory(
            nodes=nodes, time=time, values=CubicSpline(motion["time"], along[:, list(nodes)])(time),
            axis="x", name=name, label=SYNTHETIC, sigma=FILM_ERROR, held_out=nodes == others,
        )
        for name, nodes in (("node 8", (WATCHED,)), ("other front nodes", others))
    ]  # fmt: skip


def noisy(
    data: Sequence[experiment.Measurement], draw: np.random.Generator
) -> list[experiment.Measurement]:
    """Add random errors to measurements, with their stated standard error."""
    result = []
    for one in data:
        field = "force" if isinstance(one, experiment.ForceDisplacement) else "values"
        true = getattr(one, field)
        changed = true + one.sigma * draw.standard_normal(true.shape)
        result.append(replace(one, **{field: changed}))
    return result


def peak(values: NDArray[np.float64], step: float = 1.0 / RATE) -> tuple[float, float]:
    """Frequency (Hz) and damping ratio of the strongest decaying cosine between 7 and 12 Hz."""
    found = matrix_pencil(values, step)
    near = (found.damped_frequency > 7.0) & (found.damped_frequency < 12.0)
    best = int(np.argmax(np.where(near, found.amplitude, 0.0)))
    return float(found.damped_frequency[best]), float(found.damping_ratio[best])


def calibrate(folder: Path) -> tuple[experiment.Fit, experiment.Fit]:
    """Fit the folds to the synthetic static test, then the damping to the release.

    The folder keeps the evaluations and the case files of the release.
    """
    kept, draw = folder / "evaluations", np.random.default_rng(1)
    folds = fit_folds(noisy(static_data(), draw), folder=kept)
    film = noisy(release_data(released_case(folder / "truth")), draw)
    model = released_case(folder / "fitted", changes_of(folds))
    return folds, fit_damping(model, [*film, *spectra_of(film)], folder=kept)


def fit_folds(static: Sequence[experiment.Measurement], **options: Any) -> experiment.Fit:
    """Fit the length-scale ratio and theta1 = 360 - theta2 to a static test."""
    return experiment.fit(
        find_case("herkal/specimen"), static, parameters=FOLD_RANGES, ties=MIRRORED, **options
    )


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


if __name__ == "__main__":
    place = Path(sys.argv[1] if len(sys.argv) > 1 else "herkal-calibration")
    folds, damping = calibrate(place)
    for name, one in (("folds", folds), ("damping", damping)):
        for estimate in one.estimates:
            print(f"{estimate.key} = {estimate.value:.5g}, {estimate.lower:.5g} to "
                  f"{estimate.upper:.5g}")  # fmt: skip
        for score in one.scores:
            print(f"  {score.name}: rms {score.rms:.3g} {score.unit}")
        title = f"Paper specimen, synthetic data: {name}"
        (place / name).mkdir(parents=True, exist_ok=True)
        print("  ", write_fit(one, place / name, title))
    film = damping.problem.measurements[0].observed()
    for name, values in (("film", film), ("model", damping.predicted[0])):
        frequency, ratio = peak(values[round(TURNED * RATE) :])
        print(f"{name}: {frequency:.2f} Hz, damping {100.0 * ratio:.1f} % (paper: 9.5 Hz, 16 %)")
