"""The case studies and the specimen of Herkal et al., loaded slowly.

Run it to print the tables and draw the pictures of docs/statics.md:
python docs/statics_figures.py docs/images
"""

from __future__ import annotations

import sys
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np

import foldyn as fd

RATIOS = (0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0)  # L*/L_F
FACTORS = (0.1, 0.25, 0.5, 0.75, 1.0)
REPORTED = {1: ("x", [0, 1]), 2: ("x", [6, 8, 7]), 3: ("y", [2, 8, 5]), 4: ("x", [6, 8, 7])}
LAWS = ("superlinear", "linear")
TOP = list(range(7))  # of the specimen
STATED = 5  # point of the specimen's path, of 2 mm each, from which it is let go


def study(number: int, bend_law: str = "superlinear", ratio: float | None = None) -> fd.Case:
    """A shipped case study with other bends or another length-scale ratio."""
    case = fd.read_case(fd.studies.find_case(f"herkal/case{number}-static")).case()
    structure = case.structure
    sheet = structure.sheet if ratio is None else replace(structure.sheet, length_scale_ratio=ratio)
    options = asdict(structure.options) | {
        "bend_law": bend_law,
        "fold_law": structure.options.fold_law,
    }
    structure = fd.discretize(structure.pattern, sheet, **options)
    return fd.Case(structure, case.supports, case.loads)


def deflections(number: int, bend_law: str = "superlinear") -> np.ndarray:
    """Displacements (m) of the reported nodes (factor, node)."""
    axis, nodes = REPORTED[number]
    path = fd.trace(study(number, bend_law), load_factors=FACTORS)
    return path.displacement.sel(node=nodes, axis=axis).values


def shares(number: int, bend_law: str) -> np.ndarray:
    """Shares of bars, bends and folds in the energy at full load, for each ratio."""
    rows = []
    for ratio in RATIOS:
        path = fd.trace(study(number, bend_law, ratio), load_factors=FACTORS)
        share = fd.plots.energy_shares(path)
        rows.append([share[name][-1] for name in ("bars", "bends", "folds")])
    return np.array(rows)


def shipped(name: str):
    """A shipped case and its path."""
    case_file = fd.read_case(fd.studies.find_case(name))
    return case_file.case(), case_file.run()


def release(case: fd.Case, path):
    """Compress, release, vibrate: the motion of the specimen after its top is let go."""
    free = fd.Case(case.structure, case.supports[:3], damping=fd.Rayleigh(alpha=14.4))
    return fd.simulate(
        free, 0.35, method="rk4", interval=0.001, initial=fd.initial_state(path, at=STATED)
    )


def compute() -> tuple[object, dict]:
    """All results by name."""
    case, specimen = shipped("herkal/specimen")
    return case, {
        "deflections": {(k, law): deflections(k, law) for k in REPORTED for law in LAWS},
        "shares": {(k, law): shares(k, law) for k in (2, 3) for law in LAWS},
        "specimen": specimen,
        "heavy": shipped("herkal/specimen-weight")[1],
        "motion": release(case, specimen),
    }


def frequency(motion) -> float:
    """Frequency (Hz) of the top's vibration along x, from where it passes its rest position."""
    x, t = motion.displacement.sel(node=TOP, axis="x").mean("node").values, motion.time.values
    k = np.flatnonzero(x[1:] * x[:-1] < 0.0)
    crossings = t[k] - x[k] * (t[k + 1] - t[k]) / (x[k + 1] - x[k])
    return 0.5 * (len(crossings) - 1) / (crossings[-1] - crossings[0])


def check(results: dict) -> None:
    """The numbers of the design and what physics demands."""
    last = {key: moved[-1] for key, moved in results["deflections"].items()}
    np.testing.assert_allclose(-last[1, "superlinear"], 0.0312, atol=5e-5)
    np.testing.assert_allclose(-last[1, "linear"], 0.0248, atol=5e-5)
    np.testing.assert_allclose(last[2, "superlinear"], [0.0276, 0.0081, 0.0222], atol=6e-5)
    ratios = last[4, "superlinear"] / last[2, "superlinear"]
    np.testing.assert_allclose(ratios, [2.3, 5.1, 2.6], atol=0.05)

    along_x, along_y = (results["shares"][k, "superlinear"] for k in (2, 3))
    for table in results["shares"].values():
        np.testing.assert_allclose(table.sum(axis=1), 1.0, rtol=1e-12)
        assert (np.diff(table[:, 2] / table[:, 1]) > 0.0).sum() >= len(RATIOS) - 2  # softer folds
    np.testing.assert_allclose(along_x[[1, -1], 2], [0.75, 0.87], atol=5e-3)
    assert (along_x[:, 2] > 0.7).all()  # never bending-dominated
    assert (along_y[:, 1] > 0.55).all()  # never folding-dominated

    specimen, heavy, motion = (results[name] for name in ("specimen", "heavy", "motion"))
    pressed = fd.plots.total_reaction(specimen, TOP, direction="x")
    assert abs(pressed[-1] - 0.438) < 5e-4
    weight = pressed - fd.plots.total_reaction(heavy, TOP, direction="x")
    np.testing.assert_allclose(weight, 0.0205, atol=5e-4)  # the top holds half of 0.041 N
    strain = sum(motion[f"strain_{name}"].values[0] for name in ("bars", "bends", "folds"))
    stored = sum(float(specimen[f"strain_{n}"][STATED]) for n in ("bars", "bends", "folds"))
    assert abs(strain / stored - 1.0) < 1e-9
    assert float(motion.kinetic[0]) == 0.0
    assert motion.attrs["energy_error"] < 1e-6
    assert 8.5 < frequency(motion) < 10.5  # the paper measured 9.5 Hz


def deflection_table(results: dict) -> str:
    """The table of docs/statics.md."""
    moved = results["deflections"]
    lines = ["| case | nodes | superlinear bends (mm) | linear bends (mm) |", "|---|---|---|---|"]
    for k, (axis, nodes) in REPORTED.items():
        columns = [", ".join(f"{1e3 * u:.1f}" for u in moved[k, law][-1]) for law in LAWS]
        lines.append(f"| {k} | {', '.join(map(str, nodes))} along {axis} | {' | '.join(columns)} |")
    return "\n".join(lines)


def more_tables(results: dict) -> str:
    """Case 4's deflections over case 2's, and shares of bends and folds in the energy."""
    moved = results["deflections"]
    lines = ["| load factor | " + " | ".join(f"{f:g}" for f in FACTORS) + " |"]
    lines.append("|---" * (len(FACTORS) + 1) + "|")
    for law in LAWS:
        ratio = moved[4, law] / moved[2, law]
        for column, node in enumerate(REPORTED[2][1]):
            cells = " | ".join(f"{r:.2f}" for r in ratio[:, column])
            lines.append(f"| node {node}, {law} bends | {cells} |")
    lines += ["", "| $L^*/L_F$ | " + " | ".join(f"{r:g}" for r in RATIOS) + " |"]
    lines.append("|---" * (len(RATIOS) + 1) + "|")
    for (k, law), table in results["shares"].items():
        for column, part in ((1, "bends"), (2, "folds")):
            cells = " | ".join(f"{100 * s:.0f}" for s in table[:, column])
            lines.append(f"| case {k}, {law} bends: {part} (%) | {cells} |")
    return "\n".join(lines)


def draw(case, results: dict, folder: Path) -> None:
    """The specimen's forces and shape, and the snap-through of a Miura vertex."""
    paths = {"without weight": results["specimen"], "with its weight": results["heavy"]}
    fd.plots.plot_reaction(paths, TOP, direction="x").savefig(folder / "specimen-force.png", dpi=90)
    shapes = fd.plots.draw_shapes(case, results["specimen"], points=[0, -1])
    shapes.savefig(folder / "specimen-shapes.png", dpi=80)
    _, path = shipped("gallery/miura-popthrough")
    fd.plots.plot_load_displacement(path, [24], direction="-z").savefig(
        folder / "popthrough-curve.png", dpi=90
    )


if __name__ == "__main__":
    the_specimen, computed = compute()
    check(computed)
    print(deflection_table(computed), more_tables(computed), sep="\n\n")
    hertz = frequency(computed["motion"])
    print(f"\nreleased from {2 * STATED} mm, the top vibrates at {hertz:.2f} Hz")
    draw(the_specimen, computed, Path(sys.argv[1] if len(sys.argv) > 1 else "."))
