"""What acts on a crease acts on its own turn, not on that of the panels beside it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import foldyn as fd
from foldyn.structures.mesh import hinge_angles
from pairwise import in_pairs

SHEET = fd.Sheet(youngs_modulus=1e6, poissons_ratio=0.25, thickness=0.01, density=1.0)
FLAT = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=120)
TURN = Rotation.from_rotvec([0.3, 0.5, -0.7]).as_matrix()
PRESETS = ("plate", "n5b8e", "herkal", "merlin2", "shell")
K = 0.2  # N m/rad


def model(kind, k=K, law="linear", turned=False, divisions=4, sheet=SHEET, **options):
    pattern = fd.Pattern(FLAT.vertices @ TURN.T, FLAT.faces) if turned else FLAT
    options = {"crease_stiffness": k, "fold_law": law, **options}
    if kind == "shell":
        return fd.shell(pattern, sheet, divisions=divisions, **options)
    return fd.discretize(pattern, sheet, preset=kind, **options)


def opened(structure, result):
    """Turn (samples,) of the crease from rest, from its two vertices and the next ones, rad."""
    x = structure.nodes[:6] + result.displacement.values[:, :6]
    row = np.array([[2, 3, 0, 4]]) if structure.folds[0, 2] < 2 else np.array([[2, 3, 4, 0]])
    rest = hinge_angles(structure.nodes[:6], row)
    return np.array([hinge_angles(at, row) - rest for at in x]).ravel()


def balance(result):
    strain = sum(result[name] for name in result.data_vars if name.startswith("strain_"))
    left = strain + result.kinetic + result.dissipated - result.work
    return float(abs(left - left[0]).max() / abs(result.work).max())


@pytest.mark.parametrize(
    ("kind", "rigid", "turned"), in_pairs(PRESETS, [None, "all", [0]], [False, True])
)
def test_a_moment_opens_a_crease_by_its_own_stiffness(kind, rigid, turned):
    for k in (6e-4, 0.06, 6.0):
        structure = model(kind, k, rigid=rigid, turned=turned)
        load = fd.CreaseMoment("all", np.radians(1.146) * k)
        case = fd.Case(structure, supports=[fd.Fix([0, 1, 2], "xyz")], loads=[load])
        found = abs(opened(structure, fd.trace(case, steps=1))[-1])
        assert np.degrees(found) == pytest.approx(1.146, rel=1e-6)


@pytest.mark.parametrize("kind", PRESETS)
def test_a_moment_and_a_rest_angle_that_balance_it_hold_still(kind):
    """A moment M holds a crease that is at rest M / k beyond: nothing turns, bends or stretches."""
    structure = model(kind)
    angle = float(np.degrees(structure.fold_rest[0])) + 2.0
    loads = [
        fd.CreaseMoment("all", -np.radians(2.0) * K),
        fd.Actuate("all", angle=angle),
    ]
    case = fd.Case(structure, supports=[fd.Fix([0, 1, 2], "xyz")], loads=loads)
    assert abs(opened(structure, fd.trace(case, steps=1))).max() < 1e-9


@pytest.mark.parametrize("strong", [0.01, 1.0, 100.0])
def test_responses_with_damped_creases_are_those_of_n5b8e(strong):
    """n5b8e has the crease's angle as a dof; the plate's hinge has it within."""
    found = {}
    for kind in ("plate", "n5b8e"):
        case = fd.Case(
            model(kind),
            supports=[fd.Fix([0, 1, 2, 3], "xyz")],
            damping=[fd.Rayleigh(alpha=0.1), fd.CreaseDamping(0.05 * strong)],
        )
        drive = [fd.Force([4, 5], (0, 0, 1.0))]
        answer = fd.frf(case, drive=drive, frequencies=[0.2, 0.6], method="direct")
        found[kind] = answer.receptance.values[:, 4, 2]
    # their first frequencies differ by 1.8 %
    assert np.abs(found["plate"] / found["n5b8e"] - 1.0).max() < 0.06


@pytest.mark.parametrize(
    "law", ["linear", fd.Prony(0.8, 0.1, law="linear")], ids=["linear", "prony"]
)
@pytest.mark.parametrize("history", [fd.Pulse(0.3), fd.HalfSine(0.5)], ids=["jumps", "smooth"])
def test_work_of_moments_on_damped_creases(law, history):
    """By two methods: the same motion, and a balance that closes, at jumps too."""
    runs = []
    for method, dt in (("rk4", None), ("generalized_alpha", 1e-3)):
        case = fd.Case(
            model("plate", law=law),
            supports=[fd.Fix([0, 1, 2, 3], "xyz")],
            loads=[fd.CreaseMoment("all", 0.02, history=history)],
            damping=fd.CreaseDamping(0.05),
        )
        runs.append(fd.simulate(case, duration=0.8, method=method, dt=dt, every=0.05))
    one, other = (run.displacement.values[:, 4, 2] for run in runs)
    assert np.abs(one - other).max() < 2e-3 * np.abs(one).max()
    assert max(map(balance, runs)) < 2e-3
    assert float(runs[0].dissipated[-1]) == pytest.approx(float(runs[1].dissipated[-1]), rel=4e-3)


def test_a_crease_that_is_damped_far_beyond_swinging_creeps_back():
    """With c the damping and k the stiffness of the crease, as exp(-k t / c) after a ramp."""
    case = fd.Case(
        model("plate", k=2.0, sheet=replace(SHEET, density=1e-4)),
        supports=[fd.Fix([0, 1, 2, 3], "xyz")],
        loads=[fd.CreaseMoment("all", 0.02, history=fd.Ramp(1.0))],
        damping=fd.CreaseDamping(2.0),
    )
    motion = fd.simulate(case, duration=6.0, method="generalized_alpha", dt=0.01, every=0.5)
    late = motion.time.values >= 1.0
    wanted = 0.01 * (1.0 - (np.e - 1.0) * np.exp(-motion.time.values[late]))
    assert abs(opened(case.structure, motion))[late] == pytest.approx(wanted, rel=0.01)


@pytest.mark.parametrize("kind", ["plate", "shell"])
def test_turns_of_one_hinge_by_two_histories_add_up(kind):
    """A temperature and a crease that folds, and two temperatures: as with one history."""

    def run(other, first):
        structure = model(kind, divisions=2)
        warm = [fd.Temperature(10.0, curvature=2e-3, panels=p, history=h) for p, h in first]
        loads = [*warm, fd.Actuate("all", angle=230.0, history=other)]
        case = fd.Case(structure, [fd.Fix([0, 1, 2, 3], "xyz")], loads, fd.Rayleigh(alpha=5.0))
        options = (
            {"method": "generalized_alpha", "dt": 2e-3} if kind == "shell" else {"method": "rk4"}
        )
        return fd.simulate(case, duration=0.4, every=0.1, **options).displacement.values

    same, apart = fd.Ramp(0.3), fd.Ramp(0.3 + 1e-9)
    together = run(same, [(0, same), (1, same)])
    size = np.abs(together).max()
    assert size > 0.01
    assert np.abs(run(apart, [(0, same), (1, same)]) - together).max() < 1e-7 * size
    assert np.abs(run(same, [(0, apart), (1, same)]) - together).max() < 1e-7 * size
    assert np.abs(run(same, [(1, apart), (0, same)]) - together).max() < 1e-7 * size
