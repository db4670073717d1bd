"""Case files with moving supports, actuated creases, and a start that is not rest."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from case_texts import changed
from foldyn.cases import Actuate, BaseMotion, Fix, Harmonic, Impose, Ramp, Table
from foldyn.errors import InputError

MOVING = """
[[supports]]
nodes = [6, 8]
axis = "z"
displacement = [0.1, -0.2]
history = { kind = "ramp", duration = 2, smooth = true }
[[supports]]
nodes = 7
axis = "y"
displacement = 0.3
[[supports]]
base = "x"
displacement = 0.01
history = { kind = "harmonic", frequency = 2 }
[[supports]]
base = "z"
history = { kind = "table", file = "shake.csv", unit = "m" }
[[loads]]
creases = [2, 3]
angle = 200
history = { kind = "ramp", duration = 5 }
[[loads]]
creases = [1, 0]
angle = [100, 110.5]
"""


def test_moving_supports_and_actuated_creases(read, short, tmp_path) -> None:
    (tmp_path / "shake.csv").write_text("t [s],z [mm]\n0,0\n1,5\n")
    found = read(short.replace("[[loads]]\nnodes = [7, 6]\nforce = [1, 0, 0]\n", "") + MOVING)
    case = found.case()
    assert case.supports == (
        Fix("xmin"),
        Impose([6, 8], "z", [0.1, -0.2], Ramp(2.0, smooth=True)),
        Impose(7, "y", 0.3),
        BaseMotion("x", Harmonic(2.0), 0.01),
        BaseMotion("z", Table([0.0, 1.0], [0.0, 0.005])),
    )
    assert case.loads == (Actuate([2, 3], 200, Ramp(5.0)), Actuate([1, 0], [100, 110.5]))
    np.testing.assert_array_equal(np.argwhere(case.imposed), [[6, 2], [7, 1], [8, 2]])
    np.testing.assert_array_equal(found.output.nodes, [3, 4, 5, 6, 7, 8])  # what can move
    assert found.initial() is None


def test_a_rigid_start_turns_about_the_center_of_mass(read, short) -> None:
    velocity, spin = np.array([0.1, 0.2, 1.0]), np.array([3.0, 0.0, -1.0])
    masses = ["mixed_voronoi", "panel"]
    start = f"initial = {{ velocity = {velocity.tolist()}, spin = {spin.tolist()} }}"
    found = read(changed(short, f"supports =; {start}; model.mass = {masses}"))
    for rule in masses:
        state = found.initial(rule)
        assert state is not None and state.displacement is None
        structure = found.case(rule).structure
        mass = np.asarray(structure.mass.sum(axis=1)).ravel()
        v = np.asarray(state.velocity)
        momentum = mass @ v
        np.testing.assert_allclose(momentum, mass.sum() * velocity, rtol=1e-12)
        # a rigid motion keeps all distances: (vi - vj) . (xi - xj) = 0
        x = structure.nodes
        dv, dx = v[:, None] - v, x[:, None] - x
        np.testing.assert_allclose((dv * dx).sum(axis=-1), 0.0, atol=1e-13)
        # and turns with the spin: half the curl of the field
        np.testing.assert_allclose(dv, np.cross(spin, dx), atol=1e-13)
    first, second = (np.asarray(found.initial(rule).velocity) for rule in masses)
    np.testing.assert_array_equal(first, np.asarray(found.initial().velocity))
    assert first.shape == second.shape


def test_a_rigid_start_may_turn_about_a_support(read, short) -> None:
    # the hinge line x = 0 stays at rest where the translation undoes the spin's motion there
    text = changed(short, 'supports[0] = { nodes = [1], axes = "x" }')
    free = read(text)
    structure = free.case().structure
    mass = np.asarray(structure.mass.sum(axis=1)).ravel()
    arm = structure.nodes[1] - mass @ structure.nodes / mass.sum()
    velocity = -np.cross([0.0, 2.0, 0.3], arm)
    found = read(f"{text}[initial]\nvelocity = {velocity.tolist()}\nspin = [0, 2.0, 0.3]\n")
    v = np.asarray(found.initial().velocity)
    assert v[1, 0] == 0.0
    assert np.abs(v).max() > 0.1
    with pytest.raises(InputError) as caught:
        read(f"{text}[initial]\nvelocity = {(velocity * 1.01).tolist()}\nspin = [0, 2.0, 0.3]\n")
    assert "and spin = [0.0, 2.0, 0.3]: moves node 1 along x with" in str(caught.value)


def test_a_rigid_start_may_not_move_imposed_nodes(read, short) -> None:
    text = changed(short, 'supports[0] = { nodes = [1], axis = "z", displacement = 0.1 }')
    read(f"{text}[initial]\nvelocity = [1, 2, 0]\n")
    with pytest.raises(InputError, match=r"initial: velocity = .*: moves node 1 along z with 3 m/"):
        read(f"{text}[initial]\nvelocity = [1, 2, 3]\n")


@pytest.mark.matrix
def test_a_start_from_a_result(read, short, tmp_path) -> None:
    found = read(f"{short}[initial]\nfile = 'runs/first.nc'\nat = -2\n")
    missing = r'case2\.toml: initial\.file = "runs/first\.nc": .*no such'
    with pytest.raises(InputError, match=missing):
        found.initial()
    (tmp_path / "runs").mkdir()
    first = tmp_path / "runs/first.nc"
    motion = read(short).run(duration=0.01, every_steps=1)
    fd.save(motion, first)
    state = found.initial()
    np.testing.assert_array_equal(state.displacement, motion.displacement.values[-2])
    np.testing.assert_array_equal(state.velocity, motion.velocity.values[-2])
    last = read(f"{short}[initial]\nfile = 'runs/first.nc'\n").initial()
    np.testing.assert_array_equal(last.displacement, motion.displacement.values[-1])
    with pytest.raises(InputError, match=r"case2\.toml: initial\.at = 9999: the result has samp"):
        read(f"{short}[initial]\nfile = 'runs/first.nc'\nat = 9999\n").initial()
    count = len(found.case().structure.nodes)
    fd.save(motion.isel(node=slice(1, None)), first)
    other = (
        rf'"runs/first\.nc": holds a motion of {count - 1} nodes, but this structure has {count}'
    )
    with pytest.raises(InputError, match=other):
        found.initial()
