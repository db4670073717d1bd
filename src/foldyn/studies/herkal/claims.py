"""The paper's claims on the case studies, as numbers: the rows of `targets.toml`."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from functools import partial

import numpy as np
import xarray
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.studies.herkal.metric import UP_TO, content, content_of, strongest_peak
from foldyn.studies.herkal.runs import BARS_AND_HINGES, REFERENCE, RULES, reported
from foldyn.studies.herkal.study import Study, mean_ranks
from foldyn.studies.herkal.targets import Verdict, read_targets, verdicts

BAND = (1.4, 2.4)  # Hz: band in which second peaks are sought
PROMINENCE = 0.01  # smallest prominence of a peak, relative to the highest amplitude


def _edge(motion: xarray.Dataset) -> NDArray:
    """Displacement (time, nodes) of the reported nodes of case 1."""
    nodes, axis, _ = reported("case1")
    return motion["displacement"].sel(node=nodes, axis=axis).transpose("time", "node").values


def _asymmetry(study: Study, models: Iterable[str]) -> float:
    """Largest difference between the motions of the two nodes of case 1, among some models."""
    moved = [_edge(study.motions("case1")[model]) for model in models]
    ratios = [np.linalg.norm(x[:, 0] - x[:, 1]) / np.linalg.norm(x.mean(axis=1)) for x in moved]
    return float(max(ratios))


def second_peak_case1(study: Study) -> float:
    """Peak (Hz) of the spectrum of the difference between the two nodes (equi-inertial masses)."""
    motion = study.motions("case1")["equi_inertial"]
    x = _edge(motion)
    found = content_of(motion["time"].values, x[:, 0] - x[:, 1])
    return strongest_peak(*found, (0.0, UP_TO), PROMINENCE)


def _second_peak(study: Study, case: str) -> float:
    """Second peak (Hz) of the shell, all reported nodes together."""
    frequency, amplitude = content(study.motions(case)[REFERENCE], *reported(case))
    return strongest_peak(frequency, np.linalg.norm(amplitude, axis=1), BAND, PROMINENCE)


def _mismatch(study: Study, places: list[int]) -> float:
    """Largest static deviation from the shell in case 2 at some of the reported nodes."""
    found = study.displacements("case2")
    return float(np.abs(found[BARS_AND_HINGES] / found[REFERENCE] - 1.0)[places].max())


def softer_folds_move_more(study: Study) -> float:
    """Displacement of node 7, the second reported, of the shell in case 4 over that in case 2."""
    soft, stiff = (study.displacements(case)[REFERENCE][1] for case in ("case4", "case2"))
    return float(soft / stiff)


def softer_folds_err_less(study: Study) -> float:
    """Largest of the five ratios of the error in case 4 to the error in case 2."""
    return float(np.max([study.error("case4", m) / study.error("case2", m) for m in RULES]))


def _over_best(study: Study, case: str, model: str) -> float:
    """Error of a model divided by the smallest error of the five: 1 for the best model."""
    row = {m: study.error(case, m) for m in RULES}
    known = all(0.0 < error < math.inf for error in row.values())
    return row[model] / min(row.values()) if known else math.nan


def best_overall(study: Study) -> float:
    """Mean rank of circumcenter divided by the smallest mean rank of the five."""
    means = mean_ranks(study.table(models=RULES), RULES)
    known = len(study.plan.cases) == 4 and all(map(math.isfinite, means.values()))
    return means["circumcenter"] / min(means.values()) if known else math.nan


# Function that computes the number of each claim, by the key of its row; nan if it cannot.
CLAIMS: Mapping[str, Callable[[Study], float]] = {
    # how differently the two nodes of the free edge move: heavy corners are diagonally opposite
    "asymmetry_equi_inertial": partial(_asymmetry, models=("equi_inertial",)),
    "asymmetry_others": partial(_asymmetry, models=[m for m in RULES if m != "equi_inertial"]),
    "second_peak_case1": second_peak_case1,
    "second_peak_case2": partial(_second_peak, case="case2"),
    "second_peak_case3": partial(_second_peak, case="case3"),
    # the ratio is independent of the density
    "second_peaks_apart": lambda study: _second_peak(study, "case3") / _second_peak(study, "case2"),
    "mismatch_third_node": partial(_mismatch, places=[2]),  # node 8, the paper's node 3
    "match_other_nodes": partial(_mismatch, places=[0, 1]),  # nodes 6 and 7
    "softer_folds_move_more": softer_folds_move_more,
    "softer_folds_err_less": softer_folds_err_less,
    "best_case1": partial(_over_best, case="case1", model="centroid"),
    "best_case2": partial(_over_best, case="case2", model="consistent"),
    "best_case3": partial(_over_best, case="case3", model="circumcenter"),
    "best_case4": partial(_over_best, case="case4", model="circumcenter"),
    "best_overall": best_overall,
}


def claims(study: Study) -> list[Verdict]:
    """The paper's claims with computed values, if these exist."""
    return _known(study, "claims", {key: _value(claim, study) for key, claim in CLAIMS.items()})


def paper_table() -> dict[str, dict[str, float]]:
    """Table 1 of the paper: errors by case and distribution."""
    found: dict[str, dict[str, float]] = {}
    for key, target in read_targets("table1").items():
        case, _, model = key.partition("_")
        found.setdefault(case, {})[model] = target.value
    return found


def tolerance() -> float:
    """Largest relative deviation at which a number of Table 1 counts as reproduced."""
    return max(target.tolerance or 0.0 for target in read_targets("table1").values())


def table1(study: Study) -> list[Verdict]:
    """The paper's Table 1 and ours, one row for each number."""
    computed = {
        f"{case}_{model}": study.error(case, model)
        for case in study.plan.cases
        for model in study.plan.models
    }
    return _known(study, "table1", computed)


def _value(claim: Callable[[Study], float], study: Study) -> float:
    try:
        return claim(study)
    except (InputError, KeyError):  # the motion is too short for a spectrum, or missing
        return math.nan


def _known(study: Study, group: str, computed: Mapping[str, float]) -> list[Verdict]:
    return [v for v in verdicts(group, computed) if math.isfinite(v.computed)]
