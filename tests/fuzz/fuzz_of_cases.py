"""Fuzzer of case files: read, and all that the command checks before it computes."""

from __future__ import annotations

import re
from pathlib import Path

from fuzz_target import Target
from fuzz_toml import mutator

from foldyn import ram_limit
from foldyn.analyses.reading import read_case
from foldyn.studies import shipped_cases

DOCS = Path(__file__).parents[2] / "docs"
ROOM = 128 * ram_limit.MEBI
"""Memory of the machine that the command believes in: what is large is slow, too."""
WORDS = (
    "pattern", "kind", "cells", "sides", "storeys", "vertices", "faces", "assignments", "sheet",
    "thickness", "density", "model", "shell", "divisions", "scheme", "mass", "consistent", "preset",
    "herkal",
    "fold_law", "bend_law", "crease_rest", "damping", "alpha", "state", "supports", "nodes",
    "axes", "axis", "displacement", "base", "history", "table", "times", "values", "smooth",
    "loads", "force", "gravity", "creases", "angle", "analysis", "dynamics", "statics", "modes",
    "frf", "duration", "method", "dt", "steps", "load_factors", "until", "count", "frequencies",
    "secant", "seed", "output", "interval", "shapes", "initial", "velocity", "drive", "equilibrium",
    "newmark", "generalized_alpha", "dormand_prince", "auto", "arc_length", "burst_random",
    "[[supports]]", "[[loads]]", "[[drive]]", "[analysis]", "1e50", "1e-50", "1e30", "1e-30",
    "2.5", "1e-3", "7", "60", "inf", "nan", "-inf", "0x10", "0b1", "1979-05-27", "'''",
)  # fmt: skip


def seeds(_: Path) -> list[bytes]:
    """Every shipped case, and every example of the page on case files that is whole."""
    blocks = re.findall(r"```toml\n(.*?)```", (DOCS / "case-file.md").read_text("utf-8"), re.S)
    whole = [block.encode() for block in blocks if "[pattern]" in block and "[analysis]" in block]
    shipped = [path.read_bytes() for path in shipped_cases().values()]
    return [text for text in (*whole, *shipped) if b"file =" not in text]


def read(file: Path) -> None:
    """As `foldyn run` does, up to the first step."""
    with ram_limit.at_most(ROOM / ram_limit.memory()):
        case_file = read_case(file)
        computations = [case_file.computation(mass) for mass in case_file.masses]
        case_file.analysis.check([one.compute for one in computations], figures=True)


TARGET = Target("case", seeds, read, ".toml", WORDS, mutator(WORDS))
