"""Tables of the sensitivity: written as CSV, read, and summarized."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from foldyn.errors import InputError
from foldyn.input_files import read_text
from foldyn.store import warn_of_damage
from foldyn.studies.herkal.metric import best, rank_correlation, ranks
from foldyn.writing import whole

STORED = Path(__file__).with_name("results")  # tables of this repository
METRIC, FREQUENCIES = "sensitivity.csv", "frequencies.csv"
WORDS = ("case", "loads", "bend_law", "calibration", "model")  # columns with text
# Settings of the case files.
FILED = {
    "pulse": 0.5, "loads": "file", "bend_law": "superlinear", "calibration": "standard",
}  # fmt: skip

Row = Mapping[str, Any]
Errors = Mapping[str, Mapping[str, Any]]  # errors by case and model


@dataclass(frozen=True, eq=False)
class Variations:
    """Results of the sensitivity.

    Attributes
    ----------
    about : str
        Settings of the computation.
    motions : sequence of mappings
        One for each combination: case, pulse (s), loads, bend_law, calibration, and for each model
        the error of the frequency content.
    frequencies : sequence of mappings
        One for each mode: case, bend_law, calibration, model, mode, frequencies `shell` and
        `frequency` (Hz, nan for a mode without a partner) and mac.
    """

    about: str
    motions: Sequence[Row]
    frequencies: Sequence[Row]

    def chosen(self, **asked: Any) -> list[Row]:
        """Motions whose settings have the given values."""
        return [row for row in self.motions if all(row[k] == v for k, v in asked.items())]

    def filed(self, **changes: Any) -> dict[str, Row]:
        """Motions by case with the case files' settings, except for some changes.

        A file that already loads the whole edge has no other set of loaded nodes.
        """
        found = {}
        for case in sorted({row["case"] for row in self.motions}):
            asked = {**FILED, **changes}
            rows = self.chosen(case=case, **asked)
            rows = rows or self.chosen(case=case, **{**asked, "loads": FILED["loads"]})
            if rows:
                found[case] = rows[0]
        return found


def write(variations: Variations, folder: Path) -> None:
    """Write the tables into a folder; their first line records how they were computed."""
    for name, rows in ((METRIC, variations.motions), (FREQUENCIES, variations.frequencies)):
        with whole(folder / name) as part, part.open("w", encoding="utf-8", newline="") as file:
            file.write(f"# {variations.about}\n")
            table = csv.writer(file, lineterminator="\n")
            if rows:
                table.writerow(rows[0])
                table.writerows([_text(value) for value in row.values()] for row in rows)


def read(folder: Path) -> Variations | None:
    """Read the tables of a folder; None if missing or damaged."""
    if not (folder / METRIC).is_file() or not (folder / FREQUENCIES).is_file():
        return None
    try:
        about, motions = _read(folder / METRIC)
        return Variations(about, motions, _read(folder / FREQUENCIES)[1])
    except (ValueError, csv.Error):
        warn_of_damage(folder / METRIC, "it is left out")
        return None


def _read(path: Path) -> tuple[str, list[Row]]:
    first, *lines = read_text(path, "a CSV file", 64, "compute it again").splitlines() or [""]
    rows = []
    for row in csv.DictReader(lines):
        if None in row or None in row.values():
            raise InputError(f"{path}: has lines of other lengths than the first")
        rows.append({k: v if k in WORDS else float(v or "nan") for k, v in row.items()})
        if any(k in WORDS and not _is_word(v) for k, v in rows[-1].items()):
            raise InputError(f"{path}: has a number, or nothing, where a text belongs")
    return first.removeprefix("# ").strip(), rows


def _is_word(text: str) -> bool:
    try:
        float(text or "nan")
    except ValueError:
        return True
    return False


def _text(value: Any) -> Any:
    if isinstance(value, float):
        return "" if math.isnan(value) else f"{value:.4g}"
    return value


# ---------------------------------------------------------------------- ranks
@dataclass(frozen=True)
class Standing:
    """Rank of a model over many combinations.

    Attributes
    ----------
    mean_rank : float
        Mean rank over the combinations of each case, averaged over the cases.
    worst_rank, best : int
        The worst rank, and the number of combinations in which it is the best.
    median, largest : float
        Median and largest error.
    """

    mean_rank: float
    worst_rank: int
    best: int
    median: float
    largest: float


def standings(rows: Sequence[Row], models: Sequence[str]) -> dict[str, Standing]:
    """Ranks of each of the given models."""
    ranked = [ranks({m: row[m] for m in models}) for row in rows]
    cases = sorted({row["case"] for row in rows})
    found = {}
    for model in models:
        of_case = [
            np.mean([r[model] for r, row in zip(ranked, rows, strict=True) if row["case"] == case])
            for case in cases
        ]
        places, errors = [r[model] for r in ranked], [row[model] for row in rows]
        found[model] = Standing(
            float(np.mean(of_case)), max(places), places.count(1), float(np.median(errors)),
            max(errors),
        )  # fmt: skip
    return found


@dataclass(frozen=True)
class Likeness:
    """Similarity of one table of errors to another.

    Attributes
    ----------
    within : int
        Number of entries whose difference, relative to the other table, is below the tolerance.
    of : int
        Number of compared entries.
    median, largest : float
        Median and largest relative difference.
    same_best : int
        Number of cases with the same best model.
    correlation : float
        Mean rank correlation over the cases.
    """

    within: int
    of: int
    median: float
    largest: float
    same_best: int
    correlation: float


def likeness(ours: Errors, theirs: Errors, models: Sequence[str], tolerance: float) -> Likeness:
    """Compare two tables of errors by case and model, over their common entries."""
    cases = [c for c in ours if c in theirs]
    pairs = {c: ({m: ours[c][m] for m in models}, {m: theirs[c][m] for m in models}) for c in cases}
    off = np.array([abs(a[m] / b[m] - 1.0) for a, b in pairs.values() for m in models])
    return Likeness(
        int((off <= tolerance).sum()),
        len(off),
        float(np.median(off)),
        float(off.max()),
        sum(best(a) == best(b) for a, b in pairs.values()),
        float(np.mean([rank_correlation(a, b) for a, b in pairs.values()])),
    )


# ---------------------------------------------------------------------- frequencies
def frequency_errors(rows: Iterable[Row], models: Sequence[str]) -> tuple[dict[str, float], int]:
    """Mean absolute deviation of each model's frequencies, for modes that all models have.

    Return the errors by model, and the number of modes.
    """
    off: dict[tuple[Any, ...], dict[str, float]] = {}
    for row in rows:
        if row["model"] in models and math.isfinite(row["frequency"]):
            key = (row["case"], row["bend_law"], row["calibration"], row["mode"])
            off.setdefault(key, {})[row["model"]] = abs(row["frequency"] / row["shell"] - 1.0)
    common = [found for found in off.values() if len(found) == len(models)]
    means = {m: float(np.mean([f[m] for f in common])) if common else math.nan for m in models}
    return means, len(common)
