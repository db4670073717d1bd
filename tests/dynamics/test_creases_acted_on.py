"""What acts on creases: edge angles beside them (n5b8e), and turns of their own alone."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from measured import apart, balance
from moving_sheets import EXPLICIT, SHEET
from scipy.spatial.transform import Rotation

import foldyn as fd
from foldyn.dynamics import stability
from foldyn.errors import FoldynWarning
from foldyn.structures.mesh import hinge_angles
from pairwise import beyond, in_pairs

FOLD = fd.patterns.simple_fold(dihedral=120)
TURN = Rotation.from_rotvec([0.3, 0.5, -0.7]).as_matrix()
TURNED = fd.Pattern(FOLD.vertices @ TURN.T, FOLD.faces)
K = 0.2  # N m/rad
CURVED, SMOOTH = fd.EnhancedLinear(115, 122), fd.Ramp(0.4, smooth=True)
ALPHA, DP = "generalized_alpha", "dormand_prince"
HELD = [fd.Fix([0, 1, 2, 3], "xyz")]
PRONY = fd.Prony(0.5, 0.1, law="linear")
EYRING = fd.Eyring(1e-2, 1e-1, law="linear")
SWINGS = pytest.mark.filterwarnings("ignore:creases .* inertia")
pytestmark = pytest.mark.filterwarnings("ignore::foldyn.errors.StretchWarning")


def moment(history=None):
    return fd.CreaseMoment("all", 0.02, history=history)


def heat(history=None):
    return fd.Temperature(1.0, expansion=1e-5, curvature=2e-2, history=history)


def model(kind="n5b8e", k=K, law="linear", pattern=FOLD, sheet=SHEET, divisions=4, **options):
    options |= {"crease_stiffness": k, "fold_law": law}
    if kind == "shell":
        return fd.shell(pattern, sheet, divisions=divisions, **options)
    return fd.discretize(pattern, sheet, preset=kind, **options)


def case(loads, law="linear", alpha=2.0, **parts):
    parts = {"damping": fd.Rayleigh(alpha)} | parts
    return fd.Case(model(law=law), HELD, loads, **parts)


def differences(one, other):
    """Of displacements, and of energies, over the largest of both."""
    names = [*(name for name in one.data_vars if name.startswith("strain_")), "work"]
    energies = [np.array([run[name].values for name in names]) for run in (one, other)]
    return max(apart(one, other), apart(*energies))


def by_edges(made, duration, steps=(1e-4, 5e-5), method=ALPHA):
    """The motion in which edge angles have no mass."""
    return [fd.simulate(made, duration, method=method, dt=dt, interval=0.05) for dt in steps]


@pytest.mark.matrix
@pytest.mark.parametrize("law", ["linear", CURVED])
@pytest.mark.parametrize("load", [moment, heat])
def test_a_damped_motion_ends_where_statics_ends(load, law):
    made = case([load(fd.Ramp(0.1))], law, alpha=8.0)
    end = fd.simulate(made, 8.0, method="rk4", interval=8.0).displacement.values[-1]
    path = fd.trace(case([load()], law), load_factors=[0.0, 1.0]).displacement.values[-1]
    assert apart(end, path) < 1e-6


@pytest.mark.matrix
@pytest.mark.parametrize(
    ("loads", "law", "method"),
    in_pairs([[moment()], [heat(SMOOTH), moment(SMOOTH)]], ["linear", CURVED], EXPLICIT),
)
def test_motions_are_those_with_edge_angles_without_mass(method, law, loads):
    """But for what their inertia changes: 1e-5 in a sheet this soft, whatever the steps.

    A load that jumps sets edge angles swinging, which energies show.
    """
    made, central = case(loads, law), method == "central_difference"
    close = {"tolerance": 1e-8} if method == DP else {}
    found = fd.simulate(made, 0.3, method=method, interval=0.05, **close)
    for other in by_edges(made, 0.3, (2e-4, 1e-4)):
        assert apart(other, found) < 2e-5
        assert differences(other, found) < (2e-5 if len(loads) == 2 else 5e-5)
    assert balance(found) < (2e-5 if central else 1e-6)


@pytest.mark.matrix
def test_runge_kutta_keeps_its_order():
    """In displacements; and in the balance, where forces are constant."""
    steps = (8e-5, 4e-5, 1e-5)
    runs = by_edges(case([moment(fd.HalfSine(0.4))]), 0.2, steps, "rk4")
    errors = [apart(run, runs[-1]) for run in runs[:-1]]
    assert np.log2(errors[0] / errors[1]) > 3.8
    errors = [balance(fd.simulate(case([moment()]), 0.2, method="rk4", dt=dt)) for dt in steps[:-1]]
    assert np.log2(errors[0] / errors[1]) > 3.7


@pytest.mark.matrix
def test_work_of_forces_that_jump():
    """Edge angles without mass jump with them; with an inertia they are set swinging.

    The balance of energies is as good as the tolerance lets it be for swings that last.
    """
    made = case([moment(fd.Pulse(0.2))])
    found = fd.simulate(made, 0.4, method=DP, interval=0.1, tolerance=1e-10)
    other = fd.simulate(made, 0.4, method=ALPHA, dt=1e-4, interval=0.1)
    assert balance(found) < 1e-7
    assert apart(found, other) < 1e-5


SMALL = fd.Rayleigh(0.1)
RESISTING = {
    "prony": (PRONY, SMALL),
    "plastic": (fd.Plastic(5e-3, 0.02, law="linear"), SMALL),
    "eyring": (EYRING, SMALL),
    "strong": ("linear", fd.CreaseDamping(5.0)),
    "weak": ("linear", fd.CreaseDamping(1e-4)),
    "nonlinear": (CURVED, fd.CreaseDamping(0.05)),
    "damped prony": (PRONY, fd.CreaseDamping(0.05)),
    "damped eyring": (EYRING, fd.CreaseDamping(0.05)),
}
NEAR = {  # of displacements; of work and losses
    "prony": (2e-5, 1e-5), "plastic": (3e-5, 1e-3), "eyring": (2e-5, 1e-5), "weak": (5e-5, 3e-5),
    "strong": (5e-5, 4e-3),
}  # fmt: skip
LATE = (4e-3, 2e-3)  # by 1/w = 1/4600 s, in a motion of 0.3 s


def resisting(kind):
    """A case, and its motion without inertia of edge angles.

    generalized_alpha is of order 1 where dofs without mass are damped: it is extrapolated.
    """
    law, damping = RESISTING[kind]
    made = case([moment(SMOOTH), heat(SMOOTH)], law, damping=damping)
    one, other = by_edges(made, 0.3)
    return made, {
        name: other[name].values + (damping is not SMALL) * (other[name].values - one[name].values)
        for name in ("displacement", "dissipated", "work")
    }


@pytest.mark.matrix
@pytest.mark.parametrize(
    ("kind", "method"),
    [(kind, "rk4") for kind in list(RESISTING)[::2]]
    + beyond([(kind, "rk4") for kind in list(RESISTING)[1::2]], 2)
    + beyond([(kind, method) for kind in RESISTING for method in EXPLICIT if method != "rk4"]),
)
def test_creases_that_remember_or_are_damped_move_as_with_edge_angles_without_mass(method, kind):
    """A damped crease is late by the inverse of the largest frequency w; one that begins to yield
    swings a little: `test_their_inertia_is_all_that_sets_them_apart`.
    """
    made, wanted = resisting(kind)
    found = fd.simulate(made, 0.3, method=method, interval=0.05)
    moved, taken = NEAR.get(kind, LATE)
    for name, values in wanted.items():
        assert apart(found[name].values, values) < (moved if name == "displacement" else taken)
    jerky = kind == "plastic" and method == "central_difference"
    assert balance(found) < (2e-4 if jerky else 1e-6)


@pytest.mark.matrix
@pytest.mark.parametrize(
    ("kind", "order"),
    [
        ("plastic", 1),
        *beyond([
            ("strong", 1), ("prony", 2), ("eyring", 2), ("nonlinear", 1), ("damped eyring", 1),
        ]),
    ],
)  # fmt: skip
def test_their_inertia_is_all_that_sets_them_apart(kind, order, monkeypatch):
    """A larger frequency w takes it away: by 1/w where creases are damped or begin to yield."""
    made, wanted = resisting(kind)
    errors, frequencies = [], []
    for octaves in (0.0, 6.0):  # of w^2 above its least value
        monkeypatch.setattr(stability, "_LEAST", octaves)
        made = made.altered(loads=made.loads)  # as inertias are stored with their case
        found = fd.simulate(made, 0.3, method="rk4", interval=0.05)
        errors.append([apart(found[name].values, wanted[name]) for name in wanted])
        frequencies.append(fd.dynamics.largest_frequency(made))
    higher = frequencies[1] / frequencies[0]
    assert higher > 3.0
    assert (np.array(errors[1]) < 1.5 * np.array(errors[0]) / higher**order + 4e-6).all()


@pytest.mark.matrix
@SWINGS
@pytest.mark.parametrize("damping", [1e-4, 0.05, 5.0])
def test_damped_creases_are_of_order_two(damping):
    """At least, as with all memory; the balance too."""
    made = case([moment(SMOOTH)], damping=fd.CreaseDamping(damping))
    runs = by_edges(made, 0.2, (4e-5, 2e-5, 2.5e-6), "rk4")
    errors = [differences(run, runs[-1]) for run in runs[:-1]]
    assert errors[1] < 1e-11 or np.log2(errors[0] / errors[1]) > 1.7
    assert balance(runs[1]) < 1e-6


@SWINGS
@pytest.mark.parametrize(
    ("method", "kind"), beyond(product(EXPLICIT, ["strong", "damped eyring"]), 3)
)
def test_a_state_holds_what_damped_creases_remember(method, kind):
    law, damping = RESISTING[kind]
    made = case([moment(SMOOTH)], law, damping=damping)
    whole = fd.simulate(made, 0.2, method=method, interval=0.1)
    half = fd.initial_state(fd.simulate(made, 0.1, method=method, interval=0.1))
    rest = fd.simulate(made, 0.1, method=method, interval=0.1, initial=half, start=0.1)
    assert balance(rest) < 1e-5
    assert apart(rest.displacement.values[-1], whole.displacement.values[-1]) < 1e-6


@SWINGS
@pytest.mark.matrix
def test_dampers_take_what_jumps():
    """The moment of a damped crease that jumps turns it at a finite rate."""
    made = case([moment(fd.Pulse(0.1))], damping=fd.CreaseDamping(0.5))
    found = fd.simulate(made, 0.2, method=DP, interval=0.05)
    one, other = by_edges(made, 0.2)
    wanted = 2.0 * other.displacement.values - one.displacement.values
    assert apart(found.displacement.values, wanted) < 1e-4
    assert balance(found) < 1e-3


JUMPS = (
    fd.CreaseMoment([0, 1], 0.02, fd.Pulse(0.1)),
    fd.Temperature(1.0, curvature=2e-2, history=fd.Pulse(0.1)),
)
MIURA = fd.patterns.miura()


@SWINGS
@pytest.mark.parametrize(
    ("method", "error", "jump"),
    beyond(
        [(*way, jump) for jump in JUMPS for way in ((ALPHA, 1e-2), ("energy_momentum", 1e-3))], 3
    ),
)
def test_edge_angles_jump_beside_damped_creases(method, error, jump):
    """But for the turn of these; if they did not, they would ring from step to step.

    In explicit motions they swing about the same place, which energies show.
    """
    held, damping = fd.Fix(list(MIURA.faces[0])), fd.CreaseDamping(0.5, [2, 3])
    made = fd.Case(model(pattern=MIURA), [held], [jump], damping=damping)
    found = fd.simulate(made, 0.2, method=method, dt=2e-4, interval=0.05)
    other = fd.simulate(made, 0.2, method=DP, interval=0.05, tolerance=1e-7)
    assert apart(other, found) < error
    assert balance(found) < 1e-3


# ------------------------------------------------------------------ the turn of a crease alone
MODELS = ("plate", "n5b8e", "herkal", "merlin2", "shell")


def opened(structure, result):
    """Turn (samples,) of the crease from rest, from its two vertices and the next ones, rad."""
    x = structure.nodes[:6] + result.displacement.values[:, :6]
    row = np.array([[2, 3, 0, 4]]) if structure.folds[0, 2] < 2 else np.array([[2, 3, 4, 0]])
    rest = hinge_angles(structure.nodes[:6], row)
    return np.array([hinge_angles(at, row) - rest for at in x]).ravel()


@pytest.mark.parametrize("pattern", [FOLD, TURNED], ids=["", "turned"])
@pytest.mark.parametrize("rigid", [None, "all", [0]])
@pytest.mark.parametrize("kind", MODELS)
def test_a_moment_opens_a_crease_by_its_own_stiffness(kind, rigid, pattern):
    """Not by that of the panels beside it; where it has opened by M / k, nothing moves."""
    for k in (6e-4, 0.06, 6.0):
        structure = model(kind, k, rigid=rigid, pattern=pattern)
        load = fd.CreaseMoment("all", np.radians(1.146) * k)
        made = fd.Case(structure, [fd.Fix([0, 1, 2], "xyz")], [load])
        path = fd.trace(made, steps=1)
        found = np.degrees(abs(opened(structure, path)[-1]))
        assert found == pytest.approx(1.146, rel=1e-6)
    if kind == "n5b8e" and rigid is None and pattern is FOLD:
        there = path.displacement.values[-1]
        with pytest.warns(FoldynWarning, match="below the rounding errors"):
            motion = fd.simulate(made, 0.05, method="rk4", initial=fd.State(displacement=there))
        assert apart(motion.displacement.values[-1], there) < 1e-7


@pytest.mark.parametrize("kind", MODELS)
def test_a_moment_and_a_rest_angle_that_balance_it_hold_still(kind):
    """A moment M holds a crease that is at rest M / k beyond: nothing turns, bends or stretches."""
    structure = model(kind)
    angle = float(np.degrees(structure.fold_rest[0])) + 2.0
    loads = [fd.CreaseMoment("all", -np.radians(2.0) * K), fd.Actuate("all", angle=angle)]
    made = fd.Case(structure, [fd.Fix([0, 1, 2], "xyz")], loads)
    assert abs(opened(structure, fd.trace(made, steps=1))).max() < 1e-9


@pytest.mark.parametrize("strong", [0.01, 1.0, 100.0])
def test_responses_with_damped_creases_are_those_of_n5b8e(strong):
    """n5b8e has the crease's angle as a dof; the plate's hinge has it within."""
    damping = [fd.Rayleigh(alpha=0.1), fd.CreaseDamping(0.05 * strong)]
    plate, edges = (
        fd.frf(
            fd.Case(model(kind), HELD, damping=damping), [fd.Force([4, 5], (0, 0, 1.0))],
            frequencies=[0.2, 0.6], method="direct",
        ).receptance.values[:, 4, 2]
        for kind in ("plate", "n5b8e")
    )  # fmt: skip
    # their first frequencies differ by 1.8 %
    assert np.abs(plate / edges - 1.0).max() < 0.06


@pytest.mark.parametrize("law", ["linear", fd.Prony(0.8, 0.1, law="linear")], ids=["", "prony"])
@pytest.mark.parametrize("history", [fd.Pulse(0.3), fd.HalfSine(0.5)], ids=["jumps", "smooth"])
def test_work_of_moments_on_damped_creases(law, history):
    """By two methods: the same motion, and a balance that closes, at jumps too."""
    made = fd.Case(model("plate", law=law), HELD, [moment(history)], fd.CreaseDamping(0.05))
    one, other = (
        fd.simulate(made, 0.8, method=method, dt=dt, interval=0.05)
        for method, dt in (("rk4", None), (ALPHA, 1e-3))
    )
    assert apart(other, one) < 2e-3
    assert max(balance(one), balance(other)) < 2e-3
    assert float(one.dissipated[-1]) == pytest.approx(float(other.dissipated[-1]), rel=4e-3)


def test_a_crease_that_is_damped_far_beyond_swinging_creeps_back():
    """With c the damping and k the stiffness of the crease, as exp(-k t / c) after a ramp."""
    s = model("plate", k=2.0, sheet=replace(SHEET, density=1e-4))
    made = fd.Case(s, HELD, [moment(fd.Ramp(1.0))], fd.CreaseDamping(2.0))
    motion = fd.simulate(made, 6.0, method=ALPHA, dt=0.01, interval=0.5)
    late = motion.time.values >= 1.0
    wanted = 0.01 * (1.0 - (np.e - 1.0) * np.exp(-motion.time.values[late]))
    assert abs(opened(s, motion))[late] == pytest.approx(wanted, rel=0.01)


@pytest.mark.parametrize("kind", ["plate", "shell"])
def test_turns_of_one_hinge_by_two_histories_add_up(kind):
    """A temperature and a crease that folds, and two temperatures: as with one history."""
    s = model(kind, divisions=2)
    options = {"method": ALPHA, "dt": 2e-3} if kind == "shell" else {"method": "rk4"}

    def run(other, first, second):
        warm = [fd.Temperature(10.0, curvature=2e-3, panels=p, history=h)
                for p, h in enumerate((first, second))]  # fmt: skip
        loads = [*warm, fd.Actuate("all", angle=230.0, history=other)]
        made = fd.Case(s, HELD, loads, fd.Rayleigh(alpha=5.0))
        return fd.simulate(made, duration=0.4, interval=0.1, **options)

    same, late = fd.Ramp(0.3), fd.Ramp(0.3 + 1e-9)
    together = run(same, same, same)
    assert np.abs(together.displacement).max() > 0.01
    for histories in ((late, same, same), (same, late, same), (same, same, late)):
        assert apart(run(*histories), together) < 1e-7
