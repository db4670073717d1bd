"""Internal amplitudes of panels (Craig and Bampton) in modes and frequency responses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import foldyn as fd
from foldyn.dynamics import modal_damping
from foldyn.errors import InputError
from foldyn.linear import linearize
from foldyn.linear.reference import elastic, matched, modes_at_rest, reference_modes
from foldyn.structures.bars_plates import BarsPlatesTerm
from foldyn.structures.panel_modes import TURNS

SHEET = fd.Sheet(1e6, 0.3, 0.01, density=1000.0)
SQUARE = fd.Pattern([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [(0, 1, 2, 3)])
FOLD = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=90)


def edged(pattern, **options):
    return fd.discretize(pattern, SHEET, preset="n5b8e", **{"fold_law": "linear", **options})


def miura(**case):
    return fd.Case(edged(fd.patterns.miura(cells=(1, 1), panel_angle=60, dihedral=80)), **case)


def true(pattern, supports, count=5, **options):
    """The first frequencies of the shell, extrapolated."""
    shells = (fd.shell(pattern, SHEET, divisions=n, mass="consistent", fold_law="linear", **options)
              for n in (2, 4, 8))  # fmt: skip
    return reference_modes([fd.Case(s, supports(s)) for s in shells], count).frequency


def frequencies(case, internal, count=None):
    most = len(case.free_dofs)
    return elastic(fd.modes(case, count or most, internal=internal))[0]


# ---------------------------------------------------------------------------- beside the shell


def test_a_free_square_panel():
    """Its first five modes: those of a plate, the last three of which bars and hinges lack."""
    expected = true(SQUARE, lambda s: [])
    side = 13.468 / (2 * np.pi) * np.sqrt(SHEET.bending_modulus / 10.0)  # of 10 kg/m2
    assert expected[0] == pytest.approx(side, rel=2e-3)  # Leissa 1973
    case = fd.Case(edged(SQUARE))
    without, found = (frequencies(case, k)[:5] / expected - 1.0 for k in (0, 3))
    np.testing.assert_allclose(found, 0.0, atol=0.05)
    assert np.abs(without[1:]).min() > 0.25


ALONG = [fd.Fix([0, 1], along=True)]  # of an edge beside a crease, whose other panel is free
HELD = [fd.Fix([0, 1, 2, 3])]  # a panel, which is rigid


@pytest.mark.parametrize(
    ("supports", "shell", "plates", "close", "missing"),
    [
        (ALONG, {}, {"straight": [(0, 1)]}, 0.035, [4]),
        (HELD, {"rigid": [0]}, {"rigid": [0]}, 0.04, [2, 3, 4]),
    ],
)
def test_a_panel_that_swings(supports, shell, plates, close, missing):
    expected = true(FOLD, lambda s: supports, **shell)
    case = fd.Case(edged(FOLD, **plates), supports)
    without, found = (frequencies(case, k)[:5] / expected - 1.0 for k in (0, 3))
    np.testing.assert_allclose(found, 0.0, atol=close)
    assert without[missing].min() > 0.2


def test_shapes_between_the_nodes():
    """As the shell's in the middles of edges and spokes, where modes may not move any node."""
    shells = [fd.Case(fd.shell(SQUARE, SHEET, divisions=n, mass="consistent")) for n in (2, 4, 8)]
    expected = reference_modes(shells, 6)
    case = fd.Case(edged(SQUARE))
    found = modes_at_rest(case, 16, internal=3)
    paired = matched(expected, 6, case, found)
    assert paired.mac[:5].min() > 0.98
    seen, shape = expected.at(found.between_position.values)
    np.testing.assert_array_equal(seen, np.arange(8))
    first, other = found.between_shape.values[6], shape[0]
    size = np.abs(other).max()
    np.testing.assert_allclose(first * np.sign((first * other).sum()), other, atol=0.02 * size)


@pytest.mark.matrix
def test_points_between_the_nodes_move_with_rigid_motions():
    case = miura()
    found = fd.modes(case, 6, internal=3)
    x, y = case.structure.nodes, found.between_position.values
    for shape, between in zip(found["shape"].values, found.between_shape.values, strict=True):
        motion = np.linalg.lstsq(np.c_[np.ones(len(x)), x], shape, rcond=None)[0]
        np.testing.assert_allclose(between, np.c_[np.ones(len(y)), y] @ motion, atol=1e-8)


# ---------------------------------------------------------------------------- matrices


@pytest.mark.matrix
@pytest.mark.parametrize("internal", [1, 3])
def test_matrices(internal):
    case = miura()
    linear, plain = linearize(case, internal=internal), linearize(case)
    mass, stiffness = linear.mass.toarray(), linear.stiffness.toarray()
    np.testing.assert_allclose(mass, mass.T, atol=1e-14 * np.abs(mass).max())
    np.testing.assert_allclose(stiffness, stiffness.T, atol=1e-14 * np.abs(stiffness).max())
    moves = np.diag(mass) > 0.0  # all but gives of edges
    assert (~moves).sum() == case.structure.edge_gives.count
    assert np.linalg.eigvalsh(mass[np.ix_(moves, moves)]).min() > 0.0
    size = len(plain.free)
    # two free edges of each of the four panels, and two that turn
    assert len(stiffness) - size == 4 * (internal + 2 + 2 * TURNS)
    more = condensed(linear, size) - plain.stiffness.toarray()
    assert np.linalg.eigvalsh(more).min() > -1e-9 * np.abs(more).max()


def condensed(linear, size):
    """Stiffness of the first dofs, the amplitudes in balance."""
    own = linear.stiffness.toarray()
    across = own[:size, size:]
    return own[:size, :size] - across @ np.linalg.solve(own[size:, size:], across.T)


def test_creases_without_stiffness_do_not_resist_uneven_turns():
    case = fd.Case(edged(fd.patterns.miura(cells=(1, 1), dihedral=80), crease_stiffness=1e-12))
    plain = linearize(case).stiffness.toarray()
    found = condensed(linearize(case, internal=1), len(plain))
    np.testing.assert_allclose(found, plain, atol=1e-9 * np.abs(plain).max())


@pytest.mark.parametrize("times", [1e-2, 1.0, 1e2, 1e4])
@pytest.mark.parametrize("internal", [0, 1])
@pytest.mark.parametrize("rigid", [None, [0], "all"])
def test_a_moment_opens_a_crease_by_its_stiffness(times, internal, rigid):
    """Whatever its panels do; the turn of the crease is the one that its damper resists."""
    k = times * 0.06
    s = edged(FOLD, crease_stiffness=k, rigid=rigid)
    case = fd.Case(s, [fd.Fix([0, 1, 2, 3])], damping=fd.CreaseDamping(1.0))
    own, linear = linearize(case).damping.toarray(), linearize(case, internal=internal)
    turn = np.zeros(len(linear.free))
    turn[: len(own)] = own[own.diagonal().argmax()] / np.sqrt(own.diagonal().max())  # L = 1
    opened = turn @ np.linalg.solve(linear.stiffness.toarray(), turn)
    assert opened == pytest.approx(1.0 / k, rel=1e-6)


@pytest.mark.parametrize("q", [0.0, 0.05])
def test_gradients_of_turns(q):
    """Of all angles of plates, and slopes of folds, beside differences; an edge is clamped."""
    s = edged(FOLD, fold_law="enhanced", clamped=[(0, 1)])
    sheet, rng = s.body.sheet, np.random.default_rng(1)
    assert isinstance(sheet, BarsPlatesTerm)
    state = q * rng.standard_normal(sheet.size)
    found, slope = sheet.turns(state)
    model, step = sheet.model, 1e-6

    def angles(where):
        hinges, x = sheet.angles(where), model.per_reach * where[sheet.hidden]
        fold = hinges[: len(slope)] - x[model.fold_rotations].sum(axis=1)
        rows = np.where(model.angle < 0, len(hinges) - 1 - model.angle, model.angle)
        return np.concatenate([hinges, x])[rows], fold

    for way in rng.standard_normal((5, sheet.size)):
        (more, _), (less, _) = (angles(state + sign * step * way) for sign in (1, -1))
        np.testing.assert_allclose(found @ way, (more - less) / (2 * step), rtol=1e-6, atol=1e-7)
    law = sheet.rest_law(0)
    expected = model.fold_stiffness * law.slope(angles(state)[1], model.fold_rest)
    np.testing.assert_allclose(slope, expected, rtol=1e-12)


def test_translations_and_rotations_have_their_mass():
    """The whole moves without deformation: its mass and its inertia are those of the nodes."""
    case = miura()
    linear = linearize(case, internal=3)
    x = case.structure.nodes
    motions = np.zeros((len(linear.free), 6))
    for c, axis in enumerate(np.eye(3)):
        motions[: x.size, c] = np.tile(axis, len(x))
        motions[: x.size, 3 + c] = np.cross(axis, x).ravel()
    mass = np.kron(case.mass.toarray(), np.eye(3))
    expected = motions[: x.size].T @ mass @ motions[: x.size]
    np.testing.assert_allclose(motions.T @ (linear.mass @ motions), expected, atol=1e-9)
    np.testing.assert_allclose(np.diag(expected)[:3], case.total_mass)
    np.testing.assert_allclose(linear.inertia, linear.mass @ motions[:, :3], atol=1e-12)


def test_rigid_motions_are_modes():
    found = fd.modes(miura(), 10, internal=3)
    np.testing.assert_array_equal(found.rigid.values, np.arange(10) < 6)
    np.testing.assert_array_equal(found.internal_share.values[:6], 0.0)
    assert (found.internal_share.values[6:] > 0.0).all()
    assert (found.internal_share.values < 1.0).all()


@pytest.mark.matrix
def test_more_amplitudes_lower_all_frequencies():
    """More shapes of one plate, with its own mass: Rayleigh and Ritz."""
    case = miura()
    found = [frequencies(case, k, 20) for k in (1, 2, 3, 6)]
    for more, less in zip(found[1:], found, strict=False):
        assert (more <= less * (1.0 + 1e-9)).all()
        assert more[-1] < less[-1]
    free = fd.Case(edged(SQUARE))  # no edge turns: the mass is the same without them
    assert (frequencies(free, 1, 10) < frequencies(free, 0, 10)).all()


def test_without_amplitudes_nothing_changes():
    case = miura(damping=fd.Rayleigh(0.1, 1e-4))
    one, other = fd.modes(case, 12), fd.modes(case, 12, internal=0)
    for name in one.data_vars:
        if one[name].dtype.kind == "f":
            np.testing.assert_array_equal(one[name], other[name])
    assert "internal_share" not in other
    assert "internal" not in other.attrs


def test_a_turned_state():
    """Amplitudes act along the normals of the panels in the state."""
    case = miura()
    x, turn = case.structure.nodes, Rotation.from_euler("y", 1.0).as_matrix()
    moved = fd.State(displacement=x @ turn - x)
    one, other = (fd.modes(case, 14, state=state, internal=3).frequency for state in (None, moved))
    np.testing.assert_allclose(one, other, rtol=1e-6, atol=1e-9)


@pytest.mark.matrix
def test_other_numbers_and_a_mirror_image():
    pattern = fd.patterns.miura(cells=(1, 1), panel_angle=60, dihedral=80)
    order = np.random.default_rng(2).permutation(len(pattern.vertices))
    place = np.argsort(order)
    faces = [[int(place[k]) for k in face] for face in pattern.faces]
    others = [
        fd.Pattern(pattern.vertices[order], [face[1:] + face[:1] for face in reversed(faces)]),
        fd.Pattern(pattern.vertices * [1, 1, -1], [list(face)[::-1] for face in pattern.faces]),
    ]
    damping = fd.CreaseDamping(1e-3)
    one, *rest = (
        fd.modes(fd.Case(edged(each, crease_stiffness=1.0), damping=damping), 14, internal=1)
        for each in (pattern, *others)
    )
    for other in rest:
        for name in ("frequency", "damping_ratio", "internal_share"):
            np.testing.assert_allclose(other[name][6:], one[name][6:], rtol=1e-5)


def test_creases_that_remember_turn_unevenly_too():
    """A branch that relaxes at once is a damper: the ratios of both are alike."""
    pattern, k, time = fd.patterns.miura(cells=(1, 1), panel_angle=60, dihedral=80), 1.0, 1e-3
    law = fd.materials.Prony(ratios=[1.0], times=[time], law="linear")
    options = {"crease_stiffness": k, "mass": "condensed"}
    damped = fd.Case(edged(pattern, **options), damping=fd.CreaseDamping(k * time))
    relaxing = fd.Case(edged(pattern, **options, fold_law=law))
    one, other = (fd.modes(case, 9, internal=1) for case in (damped, relaxing))
    np.testing.assert_allclose(other.damping_ratio[6:], one.damping_ratio[6:], rtol=1e-3)
    np.testing.assert_allclose(other.frequency[6:], one.frequency[6:], rtol=1e-4)
    f = float(one.frequency[6]) * np.array([0.9, 1.0, 1.1])
    force = fd.Force([8], (0.3, 0.1, 1.0))
    responses = [
        fd.frf(
            fd.Case(case.structure, [fd.Fix("xmin")], damping=case.damping),
            force,
            frequencies=f,
            internal=1,
        )
        for case in (damped, relaxing)
    ]
    size = np.abs(responses[0].receptance.values).max()
    np.testing.assert_allclose(*(r.receptance.values for r in responses), atol=1e-3 * size)


def test_effective_masses_add_up():
    held = miura(supports=[fd.Fix("xmin")])
    size = len(held.free_dofs) + 8 + 20 + 8 * TURNS  # edges that turn, amplitudes
    found = fd.modes(held, size, internal=3)
    assert (found.effective_mass.sum("mode") <= found.free_mass * (1.0 + 1e-9)).all()
    np.testing.assert_allclose(found.effective_mass.sum("mode"), found.free_mass, rtol=1e-6)


def test_rigid_panels_have_none():
    rigid = fd.Case(edged(FOLD, rigid="all"))
    np.testing.assert_array_equal(frequencies(rigid, 3, 7), frequencies(rigid, 0, 7))


# ---------------------------------------------------------------------------- responses


DAMPED = [fd.Rayleigh(0.02, 1e-4), fd.ModalDamping(0.02), fd.ModalDamping(0.02, state="initial")]


@pytest.mark.parametrize("damping", DAMPED)
def test_responses_are_sums_of_modes(damping):
    case = miura(supports=[fd.Fix("xmin")], damping=damping)
    found = fd.modes(case, 12, internal=3)
    ratios = found.damping_ratio.values
    if isinstance(damping, fd.ModalDamping):
        np.testing.assert_allclose(ratios, 0.02, rtol=1e-6)
    peak = float(found.frequency[0])
    f = peak * np.array([0.5, 0.95, 1.0, 1.05, 4.0])
    force = fd.Force([8], (0.3, 0.1, 1.0))
    direct, modal = (
        fd.frf(case, force, frequencies=f, method=method, internal=3).receptance.values
        for method in ("direct", "modal")
    )
    np.testing.assert_allclose(direct, modal, atol=1e-7 * np.abs(direct).max())
    size = np.abs(direct).max(axis=(1, 2))
    assert size[2] > size[[0, 1, 3, 4]].max()


def test_a_base_moves_all_that_stands_on_it():
    """Slowly as a whole; and as forces of inertia say: x = t + H (w^2 M t)."""
    case = miura(supports=[fd.Fix("xmin")], damping=fd.Rayleigh(0.05))
    still = fd.frf(case, fd.BaseMotion("z"), frequencies=[0.0], internal=3).transmissibility.values[
        0
    ]
    np.testing.assert_allclose(still[:, 2], 1.0, atol=1e-9)
    np.testing.assert_allclose(still[:, :2], 0.0, atol=1e-9)
    linear, omega = linearize(case, internal=3), 2 * np.pi * 0.3
    impedance = (linear.stiffness - omega**2 * linear.mass + 1j * omega * linear.damping).toarray()
    load = (omega**2 - 1j * omega * 0.05) * linear.inertia[:, 2]
    moved = linear.expanded(np.linalg.solve(impedance, load)[:, None]).reshape(-1, 3)
    moved[:, 2] += 1.0
    found = fd.frf(case, fd.BaseMotion("z"), frequencies=[0.3], internal=3).transmissibility.values[
        0
    ]
    np.testing.assert_allclose(found, moved, atol=1e-8 * np.abs(moved).max())


# ---------------------------------------------------------------------------- messages


def test_damping_of_all_modes_says_how_many_are_internal(monkeypatch):
    monkeypatch.setattr(modal_damping, "MOST_MODES", 20)
    case = miura(supports=[fd.Fix("xmin")], damping=fd.ModalDamping(0.02))
    told = r"of 82 free dofs, 44 of them internal amplitudes, are too many: .* up to 20; give count"
    with pytest.raises(InputError, match=told):
        fd.modes(case, 3, internal=3)
    few = replace(case, damping=fd.ModalDamping(0.02, count=3))
    assert fd.modes(few, 3, internal=3).damping_ratio.values == pytest.approx(0.02)


BUBBLE = 'the mass is "bubble"; take mass = "condensed"'


@pytest.mark.parametrize(
    ("structure", "internal", "message"),
    [
        (edged(FOLD), 7, "internal = 7: must be at most 6"),
        (edged(FOLD), -1, "internal = -1: must be a whole number, at least 0"),
        (fd.discretize(FOLD, SHEET), 2, r'internal = 2: .* discretize with preset = "n5b8e"'),
        (fd.shell(FOLD, SHEET, divisions=4), 2, r"internal = 2: .*scheme n5b8e"),
        (edged(FOLD, mass="bubble"), 2, BUBBLE),
        (replace(edged(FOLD), node_mass=np.ones(8)), 2, "the mass is given by nodes"),
    ],
)
def test_what_is_refused(structure, internal, message):
    with pytest.raises(InputError, match=message):
        fd.modes(fd.Case(structure), 4, internal=internal)
    with pytest.raises(InputError, match=r'internal = 3: .* method = "direct" or "modal"'):
        fd.frf(miura(), fd.Force([8], (0, 0, 1)), frequencies=[1.0], method="harmonic", internal=3)


def test_results_are_kept(tmp_path):
    found = fd.modes(miura(), 8, internal=3)
    fd.save(found, tmp_path / "modes.nc")
    again = fd.load(tmp_path / "modes.nc")
    assert again.attrs["internal"] == 3
    np.testing.assert_array_equal(again.internal_share, found.internal_share)
    same = fd.modes(fd.case_of(again), 8, internal=3)
    np.testing.assert_allclose(same.frequency, found.frequency)
