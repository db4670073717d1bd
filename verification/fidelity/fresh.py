"""Sixty sheets of all patterns of the registry, drawn after superelements had been written.

    python -m verification.fidelity.fresh [--out FOLDER] [--until HH:MM]

computes the shells that are not stored yet, small ones first, then compares models with all that
are stored, writes a table of modes and prints shares of them; with `--until 00:00` it computes no
shell. A third of the sheets are clamped or held at two edges, and ten are Kresling towers. The
first ten modes count at any frequency, of superelements as they are by default, and of bars and
hinges by the preset "n5b8e", with what both state about their own errors.
"""

from __future__ import annotations

import argparse
import csv
import json
import sys
import time
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple, get_type_hints

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import Case, Fix, Link
from foldyn.condensation import superelements
from foldyn.errors import FoldynWarning, InputError
from foldyn.linear.modes import modes
from foldyn.linear.reference import RIGID, SPARE, matched, modes_at_rest
from foldyn.patterns import GENERATORS
from foldyn.patterns.generators.miura_tube import TIES
from foldyn.structures import discretize
from foldyn.structures.beyond_range import BELOW, plate_frequency
from foldyn.structures.discretized import Discretized
from verification.fidelity import cases
from verification.fidelity.compare import RESULTS, markdown
from verification.fidelity.mixed import NARROW, MixedCase, outline, sizes, turns_of
from verification.fidelity.references import Stored, computed, read_references, stored

NAME, SEED, COUNT = "fresh", 20261129, 60
MODES = 10
TOWERS = 6  # every sixth is a tower
SHEETS = tuple(kind for kind in GENERATORS if kind != "kresling")
SUPPORTS = ("free", "free", "one edge", "corners", "two edges", "clamped")
MESHES, FINE = (8, 12, 16), (8, 16, 24)
LARGE, LARGE_FINE = 20_000, 14_000  # most triangles with 16 and with 24 divisions
KNOWN = 5e-3  # largest estimated error of a reference
NEAR, WRONG = 0.05, 0.10  # errors of bars and hinges that are told, and that must be


class Row(NamedTuple):
    """A mode of the shell beside its partners; errors are relative, nan without a partner."""

    case: str
    kind: str
    support: str
    mode: int  # from 1
    shell: float  # Hz
    doubt: float  # estimated error of the shell's limit
    over_plate: float  # frequency relative to that of a free square plate
    error: float  # of superelements
    stated: float  # the same, as they estimate it
    mac: float
    bars_error: float  # of bars and hinges by "n5b8e"
    bars_stated: float  # `model_error` of the partner
    bars_mac: float
    flagged: int  # whether they name a mode of superelements within 5 % as missing, or as far off
    warned: int  # whether the structure or its modes brought any warning

    @property
    def told(self) -> bool:
        """Whether the modes of bars and hinges tell that this one is wrong or missing."""
        lost = np.isnan(self.bars_error)
        return bool(self.flagged) if lost else not abs(self.bars_stated) <= NEAR


@dataclass(frozen=True)
class FreshCase(MixedCase):
    """A case of the set."""

    def case(self, structure: Discretized) -> Case:
        """A structure with the supports, and tied if it consists of two tubes."""
        ties = structure.pattern.custom.get(TIES, ())
        links = [Link([node], to=corners) for node, corners in ties]
        along = [Fix(edge, along=True) for edge in self.held.edges]  # not creases between rims
        return Case(structure, [*(along or self.held.of(structure)), *links])

    def _rims(self) -> tuple[list[list[int]], tuple[int, ...]]:
        if self.kind not in ("miura_tube", "zipper_tubes"):
            flat = {"dihedral": 179.0} if "dihedral" in self.shape else {}
            if self.kind in ("kresling", "miura", "eggbox"):
                return super()._rims()
            return outline(GENERATORS[self.kind](**{**self.shape, **flat}))
        last = 8 * self.shape["cells"]
        return [[*range(n, n + 4), n] for n in (0, last)], (0, 1, 2, 3)

    @property
    def options(self) -> Mapping[str, Any]:
        """Options that follow from the supports."""
        clamped = self.support == "clamped"
        return {"clamped": self._ends(1)} if clamped else {}

    @property
    def held(self) -> cases.Held:
        """Its supports."""
        return cases.Held(edges=self._ends(1)) if self.support == "clamped" else super().held

    def _ends(self, count: int) -> tuple[tuple[int, int], ...]:
        rings = self._rims()[0][:count]
        return tuple(edge for ring in rings for edge in pairwise(ring))


def fresh() -> list[FreshCase]:
    """The cases."""
    rng = np.random.default_rng(SEED)
    sheets, towers = (
        zip(turns_of(rng, kinds), turns_of(rng, SUPPORTS), strict=True)
        for kinds in (SHEETS, ["kresling"])
    )
    return [_one(rng, *next(sheets if k % TOWERS else towers)) for k in range(COUNT)]


def _one(rng: np.random.Generator, kind: str, support: str) -> FreshCase:
    while True:
        shape = _shape(rng, kind)
        sheet = cases.random_sheet(rng, 1.0, 30.0)
        try:
            edge, width = sizes(GENERATORS[kind](**shape))
        except InputError:
            continue
        sheet = replace(sheet, thickness=edge * sheet.thickness)
        case = FreshCase(kind, shape, support, sheet)
        if width >= NARROW * edge and case.triangles(MESHES[-1]) <= LARGE:
            return case


def _shape(rng: np.random.Generator, kind: str) -> dict[str, Any]:
    """Arguments of a generator."""
    a = cases.spread(rng, 0.02, 2.0)
    b = a * cases.spread(rng, 1.0 / 1.6, 1.6)
    cells = [int(rng.integers(1, 4)) for _ in range(2)]
    angle, second = (float(rng.uniform(45.0, 85.0)) for _ in range(2))
    folded = {"dihedral": float(rng.uniform(15.0, 179.0))}
    skew = {"a": a, "b": b, "panel_angle": angle, **folded}
    if kind == "kresling":
        sides, twist = int(rng.integers(4, 9)), float(rng.uniform(10.0, 40.0))
        return {"sides": sides, "radius": a, "height": b, "twist": twist, "storeys": cells[0]}
    if kind in ("miura", "eggbox"):
        return {"cells": cells, **skew}
    if kind == "arc_miura":
        return {"cells": cells, **skew, "second_angle": second}
    if kind in ("miura_tube", "zipper_tubes"):
        return {"cells": cells[0], **skew}
    if kind == "yoshimura":
        return {"cells": [1 + cells[0], cells[1]], "a": a, "b": b, **folded}
    if kind == "waterbomb":
        return {"cells": cells, "a": a, "b": b, **folded}
    if kind == "resch":
        return {"cells": cells, "a": a, **folded}
    if kind == "simple_fold":
        return {"a": a, "b": b, **folded}
    if kind == "square_twist":
        return skew
    if kind == "curved_pleat":
        arc = float(rng.uniform(20.0, 120.0))
        return {"pleats": cells[0], "segments": 1 + cells[1], "a": 0.4 * b, "radius": a, "arc": arc,
                **folded}  # fmt: skip
    return {"sides": int(rng.integers(4, 7)), "a": a, "rings": cells[0]}  # a flat flasher


def reference(case: FreshCase) -> dict[str, Any]:
    """The line of a case; finer meshes where the usual ones do not tell modes well enough."""
    line = computed(case, MESHES, MODES)
    known = (stored(case, line).doubt <= KNOWN).all()
    return line if known or case.triangles(FINE[-1]) > LARGE_FINE else computed(case, FINE, MODES)


def rows(case: FreshCase, true: Stored) -> list[Row]:
    """Each mode of the shell beside both models."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FoldynWarning)
        panels = case.case(superelements(case.pattern(), case.sheet, **case.options))
        found = modes_at_rest(panels, MODES + SPARE)
    own, frequency = matched(true, MODES, panels, found), true.frequency[:MODES]
    stated = dict(zip(found["frequency"].values, found["frequency_error"].values, strict=True))
    limit = plate_frequency(case.pattern(), case.sheet)
    return [
        Row(
            case.name, case.kind, case.support, k + 1, f, true.doubt[k], f / limit,
            own.error[k], stated.get(own.frequency[k], np.nan) / f, own.mac[k], *bars,
        )
        for k, (f, bars) in enumerate(zip(frequency, _bars(case, true, frequency), strict=True))
    ]  # fmt: skip


def _bars(
    case: FreshCase, true: Stored, frequency: NDArray
) -> list[tuple[float, float, float, int, int]]:
    """The last five columns of `Row` for each mode."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        straight = {"straight": case.held.edges} if case.held.edges else {}
        made = discretize(case.pattern(), case.sheet, preset="n5b8e", **straight, **case.options)
        model = case.case(made)
        if not len(model.free_dofs):  # all vertices are held: solvers refuse the case
            return len(frequency) * [(np.nan, np.nan, 0.0, 1, 1)]
        found = modes(model, min(MODES + SPARE + RIGID, len(model.free_dofs)))
    own, error = matched(true, MODES, model, found), found["model_error"].values
    missing = np.ravel(found.attrs.get("missing_frequencies", ()))
    far = found["frequency"].values / (1.0 + error)
    flagged = np.append(missing, far[np.abs(error) > NEAR])
    judged = dict(zip(found["frequency"].values, error, strict=True))
    warned = any(issubclass(each.category, FoldynWarning) for each in told)
    return [
        (own.error[k], judged.get(own.frequency[k], np.nan), own.mac[k],
         int((np.abs(flagged / f - 1.0) < NEAR).any()), int(warned))
        for k, f in enumerate(frequency)
    ]  # fmt: skip


def write(found: Sequence[Row], path: Path) -> None:
    """Write a table of modes."""
    with path.open("w", encoding="utf-8", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(Row._fields)
        out.writerows([f"{x:.6g}" if isinstance(x, float) else x for x in row] for row in found)


def read(path: Path = RESULTS / f"{NAME}.csv") -> list[Row]:
    """Read a table of modes."""
    kinds = get_type_hints(Row).values()
    with path.open(encoding="utf-8", newline="") as file:
        lines = list(csv.reader(file))[1:]
    return [Row(*(kind(x) for kind, x in zip(kinds, line, strict=True))) for line in lines]


def table(found: Sequence[Row]) -> str:
    """Shares of modes in Markdown: of superelements, and of bars and hinges below the limit."""
    known = [row for row in found if row.doubt <= KNOWN]
    lines = []
    for name, some in (
        ("all", known),
        ("clamped or held at two edges", [r for r in known if r.support in SUPPORTS[-2:]]),
        ("towers", [r for r in known if r.kind == "kresling"]),
    ):
        error = np.abs([row.error for row in some])
        honest = np.mean([row.stated >= abs(row.error) for row in some])
        lines.append(
            [name, len(some), *(f"{100 * np.mean(error <= e):.1f} %" for e in (0.01, 0.03)),
             int(np.isnan(error).sum()), f"{100 * honest:.1f} %"]
        )  # fmt: skip
    heads = ["superelements, first ten", "modes", "within 1 %", "within 3 %", "lost",
             "stated error above the true one"]  # fmt: skip
    return markdown(heads, lines)


def bars_table(found: Sequence[Row]) -> str:
    """Shares of modes of bars and hinges in Markdown: errors below the limit, and warnings."""
    known = [row for row in found if row.doubt <= KNOWN]
    lines = []
    for name, some in (
        (
            "sheets, not clamped",
            [r for r in known if r.kind != "kresling" and r.support != "clamped"],
        ),
        ("sheets, clamped", [r for r in known if r.kind != "kresling" and r.support == "clamped"]),
        ("towers", [r for r in known if r.kind == "kresling"]),
    ):
        low = np.abs([row.bars_error for row in some if row.over_plate < BELOW])
        wrong = [row for row in some if not abs(row.bars_error) <= WRONG]
        right = [row for row in some if abs(row.bars_error) <= NEAR]
        lines.append(
            [name, len(low), f"{100 * np.mean(low <= NEAR):.0f} %" if len(low) else "none",
             len(some), len(wrong), sum(row.told for row in wrong), sum(row.told for row in right)]
        )  # fmt: skip
    heads = ["`n5b8e`", "modes below 0.6", "within 5 %", "first ten", "more than 10 % off or lost",
             "of these told", "told though within 5 %"]  # fmt: skip
    return markdown(heads, lines)


def main(arguments: list[str] | None = None) -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(description="Sixty fresh sheets.")
    parser.add_argument("--out", type=Path, default=RESULTS, help="folder of the files")
    parser.add_argument("--until", help="time of day (HH:MM) after which no shell is begun")
    given = parser.parse_args(arguments)
    known = read_references(NAME, given.out)
    for case in sorted(fresh(), key=lambda one: one.triangles(MESHES[-1])):
        if case.name in known or (given.until and time.strftime("%H:%M") >= given.until):
            continue
        known[case.name] = line = reference(case)
        with (given.out / f"{NAME}.jsonl").open("a", encoding="utf-8") as file:
            file.write(json.dumps(line, separators=(",", ":")) + "\n")
        worst = 100.0 * np.max(stored(case, line).doubt)
        print(f"{case.name}: {line['seconds']} s, +-{worst:.2f} %", file=sys.stderr, flush=True)
    stored_ones = [(case, known[case.name]) for case in fresh() if case.name in known]
    found = [row for case, line in stored_ones for row in rows(case, stored(case, line))]
    write(found, given.out / f"{NAME}.csv")
    print(f"{len(stored_ones)} of {COUNT} sheets\n\n{table(found)}\n\n{bars_table(found)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
