"""Fuzzer of selections of nodes, as case files write them."""

from __future__ import annotations

from pathlib import Path

from fuzz_target import Target

from foldyn.patterns import miura
from foldyn.patterns.selection import select

PATTERN = miura((2, 1))
WORDS = ("x", "y", "z", "xmin", "ymax", "zmin", "and", "or", "not", "<", "<=", ">", "==", "!=",
         "(", ")", "-", "~", "lambda", "x.a", "x[0]", "x()", "1j", "0x10", "'a'", "*", "**", "if",
         "else", "for", "in", "is", ":=", "await", "@", "...", "f'{x}'", "\\")  # fmt: skip


def seeds(_: Path) -> list[bytes]:
    """Conditions of every kind."""
    texts = ("xmin", "zmax and y>0", "not (x<1 or z==0)", "0 <= x < 1.5 or -1e-3 > y", "x != +2")
    return [text.encode() for text in texts]


TARGET = Target(
    "selection",
    seeds,
    lambda file: select(PATTERN, file.read_text("utf-8", "replace")),
    words=WORDS,
)
