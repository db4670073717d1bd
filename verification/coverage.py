"""Coverage of a fit's intervals: how often they contain the truth, over draws of the noise.

`python -m verification.coverage [DRAWS] [FOLDER]` fits the folds and the damping of the paper
specimen to synthetic data as `verification.herkal.calibration` makes them, each time with other
noise, and writes coverage.json next to this module: every estimate with its interval. Each draw is
fitted in full; draws share evaluations of the model at equal points, such as the start of the
search.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from foldyn.experiment import Fit
from foldyn.studies.herkal import calibration
from verification.herkal.calibration import noisy, release_data, static_data

STORED = Path(__file__).with_name("coverage.json")
DRAWS = 100
SEED = 20_000


def summary(
    fitted: Callable[[np.random.Generator], Fit], draws: int, truth: Mapping[str, float]
) -> dict[str, Any]:
    """Number of intervals that contain the truth, and the errors of the estimates.

    Data and fit use the same time step, so its error cancels; its contribution to intervals is left
    out here.
    """
    fits = [fitted(np.random.default_rng(SEED + number)) for number in range(draws)]
    found = {}
    for key in truth:
        some = [one[key] for one in fits]
        values = np.array([one.value for one in some])
        lower = [one.lower - min(one.discretization, 0.0) for one in some]
        upper = [one.upper - max(one.discretization, 0.0) for one in some]
        found[key] = {
            "truth": truth[key],
            "draws": len(some),
            "contained": sum(a <= truth[key] <= b for a, b in zip(lower, upper, strict=True)),
            "mean": float(values.mean()),
            "standard_deviation": float(values.std(ddof=1)) if len(some) > 1 else None,
            "largest_error": float(np.abs(values - truth[key]).max()),
            "mean_half_width": float(0.5 * np.mean(np.subtract(upper, lower))),
            "values": values.tolist(),
            "lower": lower,
            "upper": upper,
        }
    return found


def folds(draws: int, folder: Path) -> dict[str, Any]:
    """Coverage of the fit of the folds."""
    data = static_data()
    return summary(
        lambda draw: calibration.fit_folds(noisy(data, draw), folder=folder),
        draws, calibration.FOLDS,
    )  # fmt: skip


def damping(draws: int, folder: Path) -> dict[str, Any]:
    """Coverage of the fit of the damping to node 8 only."""
    case = calibration.released_case(folder)
    data = release_data(case)[:1]
    return summary(
        lambda draw: calibration.fit_damping(case, noisy(data, draw), folder=folder),
        draws, calibration.DAMPING,
    )  # fmt: skip


if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 else DRAWS
    place = Path(sys.argv[2] if len(sys.argv) > 2 else "herkal-coverage")
    place.mkdir(parents=True, exist_ok=True)
    result = {"confidence": 0.95, "seed": SEED}
    for part in (folds, damping):
        result |= part(count, place)
        STORED.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    for key, one in result.items():
        if isinstance(one, dict):
            print(f"{key}: {one['contained']} of {one['draws']} intervals contain {one['truth']}")
