"""One's own pattern beside the shell: which model of a sheet of paper to use, and how far up.

Run it to print the comparison and draw the picture of docs/fidelity.md:
python examples/fidelity.py docs/images
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import foldyn as fd

BELOW = 8  # modes below 0.6 of the plate frequency


def compute() -> tuple[fd.Case, fd.Fidelity]:
    """A Miura-ori of 2 x 2 cells on one edge, the opposite one lifted."""
    pattern = fd.patterns.miura(cells=(2, 2), a=0.05, b=0.05, panel_angle=60, dihedral=90)
    paper = fd.Sheet(youngs_modulus=2e9, poissons_ratio=0.3, thickness=3e-4, density=700)
    structure = fd.discretize(pattern, paper)
    case = fd.Case(structure, [fd.Fix("xmin")], [fd.Force("xmax", (0, 0, 1e-3))])
    return case, fd.fidelity(case, count=12, divisions=(4, 8))


def check(result: fd.Fidelity) -> None:
    """Plates follow the shell to 0.6 of the plate frequency, the standard does not."""
    plate, standard, edges = (result.table(model)[:BELOW] for model in result.models)
    assert result.models == ("own", "standard", "n5b8e")  # one's own is "plate"
    assert [mode.below for mode in result.table()] == [True] * BELOW + [False] * 4
    assert max(abs(mode.error) for mode in plate) < 0.10
    assert min(mode.mac for mode in plate) > 0.93
    assert max(abs(mode.error) for mode in edges) < 0.02
    assert min(mode.error for mode in standard) > 0.25
    assert max(abs(mode.mesh_error) for mode in plate) < 0.02
    softness = dict(zip(result.models, result.result["deflection_error"].values, strict=True))
    np.testing.assert_allclose(softness["own"], 0.06, atol=0.02)
    np.testing.assert_allclose(softness["n5b8e"], 0.05, atol=0.01)
    assert softness["standard"] < -0.6
    assert "use it" in result.advice


if __name__ == "__main__":
    _, found = compute()
    check(found)
    print(found)
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    fd.plots.plot_fidelity(found).savefig(folder / "fidelity.png", dpi=90)
