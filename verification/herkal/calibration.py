"""The calibration of the paper's specimen, tried on data that the same model has made.

The paper's raw data are not public. `static_data` and `release_data` are computed by the same model
with the paper's parameters (no model error), and `noisy` adds the errors of a camera and of scales.
`python -m verification.herkal.calibration FOLDER` fits both and draws them (a few minutes).
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from foldyn import experiment
from foldyn.analyses import read_case
from foldyn.experiment.calibration.fit_page import write_fit
from foldyn.signals import matrix_pencil
from foldyn.studies.herkal.calibration import (
    FORCE_ERROR,
    FRONT,
    FULL,
    SEEN,
    SYNTHETIC,
    TOP,
    WATCHED,
    changes_of,
    fit_damping,
    fit_folds,
    force_on_top,
    pressed,
    released_case,
    spectra_of,
    weighed,
)

STATIC_ERROR = 5e-5  # m: a corner in a photograph
FILM_ERROR = 1e-5  # m: 0.3 pixels of a picture with 4032 pixels over 0.13 m
RATE = 240.0  # frames per second
TURNED = 0.05  # s from the release to the first turning point


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
