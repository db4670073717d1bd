"""How often the intervals of a fit contain the truth, over draws of the noise.

`python -m foldyn.studies.herkal.coverage [DRAWS] [FOLDER]` fits the folds and the damping of the
paper specimen to synthetic data as `studies.herkal.calibration` makes them, each time with other
noise, and writes coverage.json beside this file: every estimate with its interval. Each draw is
fitted in full; evaluations of the model are shared where draws ask for the same one, as at the
start of the search.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from foldyn.experiment import Fit, fit
from foldyn.studies import find_case
from foldyn.studies.herkal import calibration

STORED = Path(__file__).with_name("coverage.json")
DRAWS = 100
SEED = 20_000


@dataclass(frozen=True)
class Interval:
    """An estimate of one draw.

    Attributes
    ----------
    value, lower, upper : float
    """

    value: float
    lower: float
    upper: float

    def contains(self, truth: float) -> bool:
        """Whether the truth lies within."""
        return self.lower <= truth <= self.upper


def intervals(
    fitted: Callable[[np.random.Generator], Fit], draws: int
) -> dict[str, list[Interval]]:
    """Intervals of all parameters over draws of the noise."""
    found: dict[str, list[Interval]] = {}
    for number in range(draws):
        for one in fitted(np.random.default_rng(SEED + number)).estimates:
            found.setdefault(one.key, []).append(Interval(one.value, one.lower, one.upper))
    return found


def summary(found: Mapping[str, Sequence[Interval]], truth: Mapping[str, float]) -> dict[str, Any]:
    """Counts of the intervals that contain the truth, and how far off the estimates are."""
    told = {}
    for key, some in found.items():
        values = np.array([one.value for one in some])
        width = np.mean([0.5 * (one.upper - one.lower) for one in some])
        told[key] = {
            "truth": truth[key],
            "draws": len(some),
            "contained": sum(one.contains(truth[key]) for one in some),
            "mean": float(values.mean()),
            "standard_deviation": float(values.std(ddof=1)) if len(some) > 1 else None,
            "largest_error": float(np.abs(values - truth[key]).max()),
            "mean_half_width": float(width),
            "values": values.tolist(),
            "lower": [one.lower for one in some],
            "upper": [one.upper for one in some],
        }
    return told


def folds(draws: int, folder: Path) -> dict[str, Any]:
    """Coverage of the fit of the folds."""
    data, case = calibration.static_data(), find_case("herkal/specimen")
    found = intervals(
        lambda draw: fit(
            case, calibration.noisy(data, draw), calibration.FOLD_RANGES,
            ties=calibration.MIRRORED, folder=folder,
        ),
        draws,
    )  # fmt: skip
    return summary(found, calibration.FOLDS)


def damping(draws: int, folder: Path) -> dict[str, Any]:
    """Coverage of the fit of the damping to node 8 alone."""
    case = calibration.released_case(folder)
    data = calibration.release_data(case)[:1]
    found = intervals(
        lambda draw: fit(
            case, calibration.noisy(data, draw), calibration.DAMPING_RANGES, folder=folder
        ),
        draws,
    )
    return summary(found, calibration.DAMPING)


def stored() -> dict[str, Any]:
    """The stored result."""
    return json.loads(STORED.read_text(encoding="utf-8"))


if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 else DRAWS
    place = Path(sys.argv[2] if len(sys.argv) > 2 else "herkal-coverage")
    place.mkdir(parents=True, exist_ok=True)
    result = {"confidence": 0.95, "seed": SEED}
    for part in (folds, damping):
        result |= part(count, place)
        STORED.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    for key, told in result.items():
        if isinstance(told, dict):
            print(
                f"{key}: {told['contained']} of {told['draws']} intervals contain {told['truth']}"
            )
