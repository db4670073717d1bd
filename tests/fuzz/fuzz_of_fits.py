"""Fuzzer of fit files: read with their measurements, and checked against their cases."""

from __future__ import annotations

from pathlib import Path

from fuzz_of_cases import ROOM
from fuzz_target import Target
from fuzz_toml import mutator

from foldyn import ram_limit
from foldyn.errors import ComputationError, InputError
from foldyn.experiment.calibration.fit_file import read_fit
from foldyn.experiment.calibration.fit_problem import problem
from foldyn.studies import find_case

FOLD = """
[pattern]
kind = "simple_fold"
dihedral = 60
[sheet]
youngs_modulus = 1e6
poissons_ratio = 0.25
thickness = 0.01
density = 1.0
[model]
preset = "plate"
fold_law = { kind = "enhanced", theta1 = 45, theta2 = 290 }
[damping]
alpha = 0.4
[[supports]]
nodes = [4, 5]
[[supports]]
nodes = [0, 1]
axes = "z"
"""
FILES = {
    "case.toml": FOLD + '[[supports]]\nnodes = [0, 1]\naxis = "x"\ndisplacement = -0.3\n'
    '[analysis]\nkind = "statics"\n',
    "swung.toml": FOLD + "[[loads]]\nnodes = [0, 1]\nforce = [-0.001, 0, 0]\n"
    'history = { kind = "half_sine", duration = 0.5 }\n[analysis]\nkind = "dynamics"\n'
    'method = "newmark"\nduration = 2.0\n[output]\ninterval = 0.02\n',
    "forces.csv": "displacement [mm],force [mN]\n-100,-8\n-200,-17\n-300,-27\n",
    "shapes.csv": "load_factor,node,x [mm],z [mm]\n0.5,0,10,1\n1,0,20,2\n1,2,11,3\n",
    "sway.csv": "time [ms];node 0 x [mm];node 2 x [mm]\n0;0;0\n100;1;2\n200;0;1\n300;-1;-1\n"
    "400;0;0\n",
    "modes.toml": FOLD + '[analysis]\nkind = "modes"\ncount = 4\n',
    "frf.toml": FOLD + "[[drive]]\nnodes = [0]\nforce = [1, 0, 0]\n[analysis]\n"
    'kind = "frf"\nfrequencies = [1]\n',
    "modes.csv": "mode,frequency [Hz],frequency_sigma [Hz],damping_ratio [%]\n1,0.45,0.01,7\n"
    "2,1.24,0.01,2.6\n",
    "bent.csv": "mode,node,x,y,z\n2,0,-1,1,\n2,1,1,0.98,0\n2,2,-0.5,0.01,-0.29\n2,3,0.5,0,0.3\n",
    "frf.csv": "frequency [Hz],node 0 x real [m/N],node 0 x imag [m/N]\n0.3,10,-1\n0.6,-4,-2\n",
}
PRESSED = """
title = "a fold"
case = "case.toml"
[[parameters]]
key = "sheet.length_scale_ratio"
guess = 1.5
lower = 0.5
upper = 4
scale = 1.0
[[parameters]]
key = "model.fold_law.theta1"
lower = 30
upper = 80
[ties]
"model.fold_law.theta2" = "335 - model.fold_law.theta1"
[[data]]
kind = "force_displacement"
file = "forces.csv"
sigma = 1e-5
name = "press"
[[data]]
kind = "shapes"
file = "shapes.csv"
sigma = 1e-4
held_out = true
set = { "sheet.thickness" = 0.02 }
[solver]
searches = 3
seed = 7
processes = 2
confidence = 0.9
"""
SWUNG = """
case = "swung.toml"
[[parameters]]
key = "damping.alpha"
guess = 0.3
[[data]]
kind = "history"
file = "sway.csv"
nodes = [0, 2]
sigma = 1e-4
[[data]]
kind = "spectrum"
file = "sway.csv"
nodes = [2]
band = [1, 6]
sigma = 1e-4
held_out = true
"""
MODAL = """
case = "modes.toml"
[[parameters]]
key = "sheet.youngs_modulus"
[[data]]
kind = "frequencies"
file = "modes.csv"
[[data]]
kind = "damping_ratios"
file = "modes.csv"
modes = [1, 2]
sigma = [0.01, 0.02]
[[data]]
kind = "mode_shapes"
file = "bent.csv"
axes = "xz"
sigma = 0.02
held_out = true
[[data]]
kind = "frf"
case = "frf.toml"
file = "frf.csv"
nodes = [0]
axis = "x"
band = [0.1, 2]
sigma = 0.1
"""
WORDS = (
    "title", "case", "parameters", "key", "guess", "lower", "upper", "scale", "ties", "data",
    "kind", "file", "sigma", "held_out", "set", "solver", "searches", "seed", "processes",
    "confidence", "history", "spectrum", "shapes", "force_displacement", "nodes", "band", "axis",
    "align", "time", "unit", "damping.alpha", "loads[0].force[2]", "sheet.thickness", "sin(",
    "case.toml", "swung.toml", "forces.csv", "sway.csv", "fit.toml", ".", "/dev/null", "1e50",
    "frequencies", "damping_ratios", "mode_shapes", "frf", "modes", "modes.toml", "modes.csv",
    "bent.csv", "frf.csv", "magnitude", "quantity", "axes", "mobility", "xyz",
    "1e-50", "0.5", "2", "0x7", "[[data]]", "[[parameters]]", "[ties]", "[solver]",
)  # fmt: skip


def seeds(folder: Path) -> list[bytes]:
    """Fits of a path, of a motion and of vibrations; the folder gets what they name."""
    for name, text in FILES.items():
        (folder / name).write_text(text, encoding="utf-8")
    return [PRESSED.encode(), SWUNG.encode(), MODAL.encode()]


def read(file: Path) -> None:
    """As `foldyn fit` does, up to the first evaluation."""
    with ram_limit.at_most(ROOM / ram_limit.memory()):
        plan = read_fit(file, find_case)
        try:
            made = problem(plan.case, plan.data, plan.parameters, plan.ties)
        except ComputationError as error:  # vibrations at the guess, which do not exist
            raise InputError(str(error)) from None
        made.space.guesses(plan.solver["searches"], plan.solver["seed"])


TARGET = Target("fit", seeds, read, ".toml", WORDS, mutator(WORDS))
