"""The shell's modes of a case, extrapolated in the size of its mesh."""

from __future__ import annotations

from foldyn.linear.reference import DIVISIONS, Reference, reference_modes
from foldyn.shells import shell
from foldyn.studies.fidelity.cases import FidelityCase

MODES = 10  # elastic ones, the lowest


def reference(case: FidelityCase) -> Reference:
    """Modes of a case by the shell, frequencies extrapolated with the square of the mesh size."""
    pattern, sheet = case.pattern(), case.sheet
    cases = [
        case.case(shell(pattern, sheet, divisions=n, mass="consistent"))
        for n in (DIVISIONS[0] // 2, *DIVISIONS)
    ]
    return reference_modes(cases, MODES)
