"""Small case files for the viewer."""

from __future__ import annotations

SHEET = """
[sheet]
youngs_modulus = 1e6
poissons_ratio = 0.25
thickness = 0.01
density = 1.0
"""
FOLD = f"""# a fold that is pressed
title = "A fold"
[pattern]
kind = "simple_fold"
dihedral = 90
{SHEET}
[model]
fold_law = "linear"
bend_law = "linear"
[damping]
alpha = 0.1
[[supports]]
nodes = [4, 5]
axes = "xyz"
[[supports]]
nodes = [0, 1]
axes = "z"
[[loads]]
nodes = [0, 1]
force = [-1e-3, 0, 0]
history = {{ kind = "half_sine", duration = 0.5 }}
[analysis]
kind = "dynamics"
method = "rk4"
duration = 2.0
[output]
interval = 0.01
"""
MIURA = f"""
[pattern]
kind = "miura"
cells = [2, 1]
{SHEET}
[[supports]]
nodes = "xmin"
axes = "xyz"
[model]
preset = "plate"
[analysis]
kind = "modes"
"""


def write(folder, text=FOLD, name="fold.toml"):
    path = folder / name
    path.write_text(text, "utf-8")
    return path
