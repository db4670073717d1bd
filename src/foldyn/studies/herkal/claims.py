"""What the paper says of the case studies, as numbers: the rows of `targets.toml`."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.signals import find_peaks, spectrum
from foldyn.studies.herkal.metric import UP_TO, content
from foldyn.studies.herkal.models import REFERENCE, paper_rules
from foldyn.studies.herkal.study import Study, mean_ranks
from foldyn.studies.targets import Target, Verdict, read_targets, verdicts

if TYPE_CHECKING:
    import xarray

TARGETS = Path(__file__).with_name("targets.toml")
BAND = (1.4, 2.4)  # Hz, where second peaks are sought
NO_VALUE = math.nan


def _histories(study: Study, case: str, model: str) -> tuple[NDArray, float] | None:
    """Displacement (time, nodes) of the reported nodes, and the sampling interval."""
    motion = study.result(case, model, "motion") if case in study.plan.cases else None
    if motion is None:
        return None
    nodes, axis = study.reported(case)
    x = motion["displacement"].sel(node=nodes, axis=axis).transpose("time", "node").values
    return x, float(motion["time"][1] - motion["time"][0])


def _asymmetry(study: Study, model: str) -> float:
    found = _histories(study, "case1", model)
    if found is None:
        return NO_VALUE
    x = found[0]
    return float(np.linalg.norm(x[:, 0] - x[:, 1]) / np.linalg.norm(x.mean(axis=1)))


def asymmetry_equi_inertial(study: Study) -> float:
    """How unlike the two nodes of the free edge move: two heavy corners lie across each panel."""
    return _asymmetry(study, "equi_inertial")


def asymmetry_others(study: Study) -> float:
    """The same of the paper's other distributions, the largest."""
    return max(_asymmetry(study, m) for m in paper_rules() if m != "equi_inertial")


def second_peak_case1(study: Study) -> float:
    """Peak (Hz) of the spectrum of the difference of the two nodes, equi-inertial."""
    found = _histories(study, "case1", "equi_inertial")
    if found is None:
        return NO_VALUE
    x, dt = found
    frequency, amplitude = spectrum(x[:, 0] - x[:, 1], dt)
    kept = frequency <= UP_TO
    return _strongest(frequency[kept], amplitude[kept], (0.0, UP_TO))


def _strongest(frequency: NDArray, amplitude: NDArray, band: tuple[float, float]) -> float:
    peaks = find_peaks(frequency, amplitude, prominence=0.01)
    inside = (peaks.frequency > band[0]) & (peaks.frequency < band[1])
    if not inside.any():
        return NO_VALUE
    return float(peaks.frequency[inside][np.argmax(peaks.height[inside])])


def _second_peak(study: Study, case: str) -> float:
    motion = study.result(case, REFERENCE, "motion") if case in study.plan.cases else None
    if motion is None:
        return NO_VALUE
    frequency, amplitude = content(motion, *study.reported(case))
    return _strongest(frequency, np.linalg.norm(amplitude, axis=1), BAND)


def second_peak_case2(study: Study) -> float:
    """Second peak (Hz) of the shell, all reported nodes together."""
    return _second_peak(study, "case2")


def second_peak_case3(study: Study) -> float:
    """Second peak (Hz) of the shell, all reported nodes together."""
    return _second_peak(study, "case3")


def second_peaks_apart(study: Study) -> float:
    """Second peak of case 3 over that of case 2, in which the density plays no part."""
    return second_peak_case3(study) / second_peak_case2(study)


def _static_deviation(study: Study, case: str) -> NDArray | None:
    """Static displacement over that of the shell, less one, of the reported nodes."""
    if case not in study.plan.cases:
        return None
    found = study.displacements(case)
    if "shell" not in found or "bars and hinges" not in found:
        return None
    return found["bars and hinges"] / found["shell"] - 1.0


def mismatch_third_node(study: Study) -> float:
    """Size of the deviation at node 8, the paper's node 3."""
    off = _static_deviation(study, "case2")
    return NO_VALUE if off is None else float(abs(off[2]))


def match_other_nodes(study: Study) -> float:
    """Largest size of the deviations at nodes 6 and 7."""
    off = _static_deviation(study, "case2")
    return NO_VALUE if off is None else float(np.abs(off[:2]).max())


def softer_folds_move_more(study: Study) -> float:
    """Displacement of node 7 of the shell, case 4 over case 2."""
    paths = [study.result(c, REFERENCE, "path") for c in ("case4", "case2")]
    soft, stiff = (math.nan if p is None else _at_seven(p) for p in paths)
    return soft / stiff


def _at_seven(path: xarray.Dataset) -> float:
    return float(path["displacement"].sel(node=7, axis="x").values[-1])


def softer_folds_err_less(study: Study) -> float:
    """Largest of the five ratios of errors, case 4 over case 2."""
    ratios = [study.error("case4", m) / study.error("case2", m) for m in paper_rules()]
    return float(np.max(ratios))


def _over_best(study: Study, case: str, model: str) -> float:
    """Error of a model over the smallest of the five: 1 where it is the best."""
    row = {m: study.error(case, m) for m in paper_rules()}
    known = all(0.0 < error < math.inf for error in row.values())
    return row[model] / min(row.values()) if known else NO_VALUE


def best_case1(study: Study) -> float:
    """Error of centroid over the smallest."""
    return _over_best(study, "case1", "centroid")


def best_case2(study: Study) -> float:
    """Error of consistent over the smallest."""
    return _over_best(study, "case2", "consistent")


def best_case3(study: Study) -> float:
    """Error of circumcenter over the smallest."""
    return _over_best(study, "case3", "circumcenter")


def best_case4(study: Study) -> float:
    """Error of circumcenter over the smallest."""
    return _over_best(study, "case4", "circumcenter")


def best_overall(study: Study) -> float:
    """Mean rank of circumcenter over the smallest of the five."""
    means = mean_ranks(study.table(models=paper_rules()), paper_rules())
    known = len(study.plan.cases) == 4 and all(map(math.isfinite, means.values()))
    return means["circumcenter"] / min(means.values()) if known else NO_VALUE


CLAIMS: Mapping[str, Callable[[Study], float]] = {
    claim.__name__: claim
    for claim in (
        asymmetry_equi_inertial,
        asymmetry_others,
        second_peak_case1,
        second_peak_case2,
        second_peak_case3,
        second_peaks_apart,
        mismatch_third_node,
        match_other_nodes,
        softer_folds_move_more,
        softer_folds_err_less,
        best_case1,
        best_case2,
        best_case3,
        best_case4,
        best_overall,
    )
}
"""By the key of their row, each with the number that is measured; nan where it cannot be."""


def claims(study: Study) -> list[Verdict]:
    """The paper's claims beside what was computed; those that could not be are left out."""
    return _known(study, "claims", {key: _value(claim, study) for key, claim in CLAIMS.items()})


@cache
def _table1() -> Mapping[str, Target]:
    return read_targets(TARGETS, "table1")


def paper_table() -> dict[str, dict[str, float]]:
    """Table 1 of the paper: errors by case and distribution."""
    found: dict[str, dict[str, float]] = {}
    for key, target in _table1().items():
        case, _, model = key.partition("_")
        found.setdefault(case, {})[model] = target.value
    return found


def tolerance() -> float:
    """Deviation, as a fraction, up to which a number of Table 1 is said to agree."""
    return max(target.tolerance or 0.0 for target in _table1().values())


def table1(study: Study) -> list[Verdict]:
    """The paper's Table 1 beside ours, a row for each number."""
    computed = {
        f"{case}_{model}": study.error(case, model)
        for case in study.plan.cases
        for model in study.plan.models
    }
    return _known(study, "table1", computed)


def _value(claim: Callable[[Study], float], study: Study) -> float:
    try:
        return claim(study)
    except InputError:  # a motion that is too short for it
        return NO_VALUE


def _known(study: Study, group: str, computed: Mapping[str, float]) -> list[Verdict]:
    found = verdicts(read_targets(TARGETS, group), computed)
    return [v for v in found if math.isfinite(v.computed)]
