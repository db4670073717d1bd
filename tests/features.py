"""What goes with what: each method with each feature, tried on a small sheet.

python tests/features.py        writes the table of docs/features.md anew
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import foldyn as fd
from foldyn.dynamics import METHODS
from foldyn.errors import FoldynWarning, InputError
from named_models import named

PAGE = Path(__file__).resolve().parents[1] / "docs/features.md"
BEGIN, END = "<!-- table -->\n", "<!-- end of the table -->\n"
COLUMNS = (*METHODS, "newton", "arc_length", "mgdcm", "modes", "frf")
DURATION = 2e-3  # s
SHEET = fd.Sheet(1e6, 0.25, 0.01, 1.0)
PATTERN = fd.patterns.miura(cells=(1, 1))
FLOOR = fd.Plane((0, 0, -0.05), (0, 0, 1))


@dataclass(frozen=True)
class Setting:
    """The mass rule of bars and hinges, and whether supports move."""

    mass: str = "mixed_voronoi"
    moves: bool = False

    def sheet(self, pattern: fd.Pattern = PATTERN, **options: Any) -> fd.Structure:
        return fd.discretize(pattern, SHEET, mass=self.mass, **named(options))

    def shell(self) -> fd.Shell:
        return fd.shell(PATTERN, SHEET, divisions=1)

    def case(self, structure: Any = None, supports=(), loads=(), **parts: Any) -> fd.Case:
        push = fd.Force([5], (0.0, 0.0, 1e-4), fd.Ramp(DURATION))
        moved = [fd.Impose([2], "z", 1e-4, fd.Ramp(DURATION))] if self.moves else []
        held = [fd.Fix([0, 1], "xyz"), fd.Fix([2], "xy" if self.moves else "xyz"), *moved]
        structure = self.sheet() if structure is None else structure
        return fd.Case(structure, [*held, *supports], [push, *loads], **parts)

    def law(self, law: Any, **options: Any) -> fd.Case:
        return self.case(self.sheet(fold_law=law, **options))


Make = Callable[[Setting], fd.Case]


def both(name: str, **parts: Any) -> dict[str, Make]:
    """Parts of a case with either kind of panels."""
    return {
        name: lambda s: s.case(**parts),
        f"{name} of `n5b8e`": lambda s: s.case(s.sheet(scheme="n5b8e"), **parts),
    }


LAWS = {
    "relax (`prony`)": fd.Prony([0.5], [0.1]),
    "yield (`plastic`)": fd.Plastic(1e-5, 0.01),
    "creep (`eyring`)": fd.Eyring(1e-3, 1e-3),
}
FEATURES: Mapping[str, Make] = {
    "bars and hinges": lambda s: s.case(),
    "plates (`n5b8e`)": lambda s: s.case(s.sheet(scheme="n5b8e")),
    "panels' membranes": lambda s: s.case(s.sheet(membrane="panel")),
    "panels' membranes (`n5b8e`)": lambda s: s.case(s.sheet(preset="n5b8e", membrane="panel")),
    "shells": lambda s: s.case(s.shell()),
    "springs": lambda s: s.case(supports=[fd.Spring(1.0, nodes=[7])]),
    "springs of changing length": lambda s: s.case(
        supports=[fd.Spring(1.0, between=[(5, 7)], change=1e-4, history=fd.Ramp(DURATION))]
    ),
    "springs of changing stiffness": lambda s: s.case(
        supports=[fd.Spring(1.0, nodes=[7], stiffness_history=fd.Ramp(1.0))]
    ),
    "bars": lambda s: s.case(supports=[fd.Bar([(5, 7)], 1.0, mass=1e-3)]),
    "cables": lambda s: s.case(
        supports=[fd.Cable([5, 7, (3, 1, 1)], 1.0, change=-0.01, history=fd.Ramp(DURATION))]
    ),
    "cables with friction": lambda s: s.case(
        supports=[
            fd.Cable([5, 7, (3, 1, 1)], 1.0, change=-0.01, history=fd.Ramp(DURATION), friction=0.2)
        ]
    ),
    "releases": lambda s: s.case(
        supports=[fd.Bar([(5, 7)], 1.0, until={"line": 0, "tension": 1.0})]
    ),
    "end stops": lambda s: s.case(supports=[fd.Stop([0], 150.0, stiffness=1e-3, side="below")]),
    "damped end stops": lambda s: s.case(
        supports=[fd.Stop([0], 299.9, stiffness=1e-3, damping=1e-6)]
    ),
    "latches": lambda s: s.case(supports=[fd.Latch([0], 299.9, stiffness=1e-3)]),
    "latches of `n5b8e`": lambda s: s.case(
        s.sheet(scheme="n5b8e"), [fd.Latch([0], 299.9, stiffness=1e-3)]
    ),
    "clamped edges": lambda s: s.case(s.sheet(clamped=[(0, 1)])),
    "clamped edges of `n5b8e`": lambda s: s.case(s.sheet(scheme="n5b8e", clamped=[(0, 1)])),
    "ties, rigid panels": lambda s: s.case(s.sheet(rigid=[3]), [fd.Link([5, 7], "z")]),
    "dashpots": lambda s: s.case(supports=[fd.Dashpot(1e-3, nodes=[7])]),
    **both("damped creases", damping=fd.CreaseDamping(1e-4)),
    "stiffness-proportional damping": lambda s: s.case(damping=fd.Rayleigh(0.1, 1e-5)),
    "modal damping": lambda s: s.case(damping=fd.ModalDamping(0.01)),
    "damped strains": lambda s: s.case(damping=fd.StrainDamping(1e-5)),
    "pressure": lambda s: s.case(loads=[fd.Pressure(1e-4)]),
    **both("moments of creases", loads=[fd.CreaseMoment([0], 1e-5)]),
    "actuated creases": lambda s: s.case(loads=[fd.Actuate([0], 119.0, history=fd.Ramp(1.0))]),
    **both("temperature", loads=[fd.Temperature(1.0, 1e-6, 1e-3)]),
    "contact of panels": lambda s: s.case(contact=fd.Contact()),
    "contact with planes": lambda s: s.case(contact=fd.Contact(planes=[FLOOR], panels=False)),
    "contact with friction": lambda s: s.case(contact=fd.Contact(planes=[FLOOR], friction=0.2)),
    "contact of `n5b8e`": lambda s: s.case(s.sheet(scheme="n5b8e"), contact=fd.Contact()),
    "contact of shells": lambda s: s.case(s.shell(), contact=fd.Contact()),
    "contact of thick panels": lambda s: s.case(
        s.sheet(fd.thicken(fd.patterns.simple_fold(dihedral=90), SHEET.thickness)),
        contact=fd.Contact(),
    ),
    "a law for each family of creases": partial(
        Setting.law, law={"mountain": "linear", "valley": fd.EnhancedLinear(theta1=60.0)}
    ),
    **{
        f"creases{of} that {name}": partial(Setting.law, law=law, **options)
        for of, options in (("", {}), (" of `n5b8e`", {"scheme": "n5b8e"}))
        for name, law in LAWS.items()
    },
}


REASONS: Mapping[str, tuple[str, str]] = {
    "a": (
        "contacts stick or slide",
        "contacts stick or slide, so that no linear law describes small motions",
    ),
    "c": ("stiffness_history", "only motions have a time in which a stiffness can vary"),
    "d": (
        "needs a motion",
        "cables rub against the motion, and where they stick, no linear law describes small ones",
    ),
    "b": (
        "creep",
        "load factors that the method finds may turn back, so that no step has a time in which "
        "creases creep",
    ),
}
"""Why something is refused: what its message holds, and the words of the page."""


def tried(column: str, make: Make, setting: Setting) -> str:
    """What a method says to a case: nothing where it computes it."""
    try:
        case = make(setting)
        if column in METHODS:
            given = {"dt": DURATION / 4} if METHODS[column].implicit else {}
            fd.simulate(case, DURATION, method=column, **given)
        elif column == "modes":
            fd.modes(case, 1)
        elif column == "frf":
            fd.frf(case, fd.Force([5], (0.0, 0.0, 1.0)), frequencies=[1.0])
        else:
            timed = {"duration": 1.0} if case.remembering and column == "newton" else {}
            fd.trace(case, column, steps=2, **timed)
    except InputError as error:
        return str(error)
    return ""


def refusals(names: Iterable[str] = FEATURES) -> dict[tuple[str, str], str]:
    """What is refused of features by each method, in its words; "" where all goes."""
    found = {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FoldynWarning)
        for name, column in product(names, COLUMNS):
            settings = [Setting()]
            if column in METHODS:
                settings.append(Setting("consistent", moves=True))
            said = (tried(column, FEATURES[name], setting) for setting in settings)
            found[name, column] = next(filter(None, said), "")
    return found


def reason(said: str) -> str:
    """The letter of a refusal."""
    return next(letter for letter, (holds, _) in REASONS.items() if holds in said)


def row(name: str, said: Mapping[tuple[str, str], str]) -> str:
    """The line of a feature in the table."""
    cells = [reason(said[name, one]) if said[name, one] else "yes" for one in COLUMNS]
    return f"| {name} | " + " | ".join(cells) + " |"


def table(said: Mapping[tuple[str, str], str]) -> str:
    """What works with all methods, and the table of the rest with the reasons that it has."""
    used = {reason(words) for words in said.values() if words}
    whole = [name for name in FEATURES if not any(said[name, one] for one in COLUMNS)]
    lines = [f"With all methods: {'; '.join(whole)}.", ""]
    lines.append("| | " + " | ".join(f"`{name}`" for name in COLUMNS) + " |")
    lines.append("|---" * (1 + len(COLUMNS)) + "|")
    lines += [row(name, said) for name in FEATURES if name not in whole]
    notes = [f"- **{letter}**: {text}." for letter, (_, text) in REASONS.items() if letter in used]
    return "\n".join([*lines, "", *notes]) + "\n"


if __name__ == "__main__":
    before, rest = PAGE.read_text("utf-8").split(BEGIN)
    after = rest.split(END)[1]
    PAGE.write_text(f"{before}{BEGIN}{table(refusals())}{END}{after}", "utf-8")
