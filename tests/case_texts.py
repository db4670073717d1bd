"""Beginnings of case files that many tests have, edits of them, and tables of refused edits."""

from __future__ import annotations

import re
import tomllib

import tomli_w

SHEET_TEXT = """[sheet]
youngs_modulus = 1e6
poissons_ratio = 0.25
thickness = 0.01
density = 1.0
"""
MIURA_TEXT = f"""
[pattern]
kind = "miura"
{SHEET_TEXT}"""
FOLD_TEXT = f"""
[pattern]
kind = "simple_fold"
dihedral = 60
{SHEET_TEXT}"""
HELD_MIURA_TEXT = f"""{MIURA_TEXT}[[supports]]
nodes = "xmin"
"""
HELD_FOLD_TEXT = f"""{FOLD_TEXT}[[supports]]
nodes = [4, 5]
[[supports]]
nodes = [0, 1]
axes = "z"
"""
SHELL_MODES = """[pattern]
kind = "simple_fold"
a = 0.1
b = 0.1
dihedral = 120
[model]
kind = "shell"
divisions = 2
[[supports]]
nodes = [4, 5]
axes = "xyz"
along = true
[analysis]
kind = "modes"
count = 2
"""
PLATE = '[model]\npreset = "plate"\n'  # what takes milliseconds, whatever the defaults
MODES_TEXT = f"""{HELD_MIURA_TEXT}{PLATE}[analysis]
kind = "modes"
count = 4
"""
LIFTED_TEXT = f"""{FOLD_TEXT}[[supports]]
nodes = [0, 1, 2, 3]
axes = "xyz"
[[contact.planes]]
point = [0, 0, -0.006]
normal = [0, 0, 1]
motion = [0, 0, 0.02]
[analysis]
kind = "statics"
method = "displacement"
steps = 2
"""


def edited(text: str, *pairs: tuple[str, str]) -> str:
    """Text with things replaced that occur in it once."""
    for old, new in pairs:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return text


def changed(text: str, edits: str) -> str:
    """Case file with keys set or left out, as in "sheet.density =; loads[0].nodes = [3]"."""
    document = tomllib.loads(text)
    for edit in filter(None, edits.split("; ")):
        key, _, value = edit.partition(" =")
        *inner, last = [int(name) if name.isdigit() else name for name in re.findall(r"\w+", key)]
        place = document
        for name in inner:
            place = place[name] if isinstance(name, int) else place.setdefault(name, {})
        if not value:
            del place[last]
        elif isinstance(place, list) and last == len(place):
            place += tomllib.loads(f"v = [{value}]")["v"]
        else:
            place[last] = tomllib.loads(f"v ={value}")["v"]
    return tomli_w.dumps(document)


def rows(table: str) -> list[tuple[str, str]]:
    """Edits and messages: rows "edits | message", or messages that begin with the edit and ": ".

    Lines that are indented go on with the row above.
    """
    found = []
    for row in re.split(r"\n(?! )", table.strip("\n")):
        row = re.sub(r"\n +", " ", row)
        edits, bar, message = row.partition(" | ")
        found.append((edits, message) if bar else (row.split(": ")[0], row))
    return found


def begins(line: str, message: str) -> bool:
    """Whether a line begins with a message and holds what stands behind " ... " in it."""
    first, *more = message.split(" ... ")
    return line.startswith(first.strip()) and all(text in line for text in more)
