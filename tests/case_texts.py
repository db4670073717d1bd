"""Beginnings of case files: the patterns and the sheet that most of those in tests have."""

from __future__ import annotations

_SHEET = """[sheet]
youngs_modulus = 1e6
poissons_ratio = 0.25
thickness = 0.01
density = 1.0
"""
MIURA_TEXT = f"""
[pattern]
kind = "miura"
{_SHEET}"""
FOLD_TEXT = f"""
[pattern]
kind = "simple_fold"
dihedral = 60
{_SHEET}"""
HELD_MIURA_TEXT = f"""{MIURA_TEXT}[[supports]]
nodes = "xmin"
"""
HELD_FOLD_TEXT = f"""{FOLD_TEXT}[[supports]]
nodes = [4, 5]
[[supports]]
nodes = [0, 1]
axes = "z"
"""
MODES_TEXT = f"""{HELD_MIURA_TEXT}[analysis]
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
