"""Modes and frequency responses with directions held, links and rigid panels."""

from __future__ import annotations

import numpy as np
import pytest
from frf_structures import chain

import foldyn as fd
from foldyn.linear import linearize

SHEET = fd.Sheet(1e6, 0.25, 0.01, density=1.0)
A, B = np.radians(25.0), np.radians(40.0)
TURN = np.array([[np.cos(A), 0, np.sin(A)], [0, 1, 0], [-np.sin(A), 0, np.cos(A)]]) @ np.array(
    [[np.cos(B), -np.sin(B), 0], [np.sin(B), np.cos(B), 0], [0, 0, 1]]
)
MODELS = {
    "bars": lambda pattern: fd.discretize(
        pattern, SHEET, mass="consistent", bend_law="linear", fold_law="linear", preset="herkal"
    ),
    "shell": lambda pattern: fd.shell(pattern, SHEET, divisions=3, fold_law="linear"),
}


def pair(model) -> tuple[fd.Case, fd.Case]:
    """A fold on rollers, and the same turned: held in directions."""
    pattern = fd.patterns.simple_fold()
    turned = fd.Pattern(pattern.vertices @ TURN.T, pattern.faces, pattern.assignments)
    damping = fd.Rayleigh(0.3, 1e-4)
    return (
        fd.Case(MODELS[model](pattern), [fd.Fix([4, 5]), fd.Fix([0, 1], "z")], damping=damping),
        fd.Case(MODELS[model](turned), [fd.Fix([4, 5]), fd.Fix([0, 1], direction=TURN[:, 2])],
                damping=damping),
    )  # fmt: skip


@pytest.mark.parametrize("model", MODELS)
def test_modes_of_a_turned_structure(model) -> None:
    """Frequencies, shapes and damping as before; effective masses by the turned axes."""
    one, other = (fd.modes(case, 6) for case in pair(model))
    np.testing.assert_allclose(one.frequency, other.frequency, rtol=1e-9)
    np.testing.assert_allclose(one.damping_ratio, other.damping_ratio, rtol=1e-7)
    shapes = one["shape"].values @ TURN.T
    signs = np.sign(np.einsum("kni,kni->k", shapes, other["shape"].values))
    np.testing.assert_allclose(shapes * signs[:, None, None], other["shape"], atol=1e-5)
    assert other.complete == one.complete


def test_effective_masses_add_up() -> None:
    """To what can move along each axis: all modes together, also where directions are held."""
    case = pair("bars")[1]
    found = fd.modes(case, len(case.free_dofs))
    np.testing.assert_allclose(found.effective_mass.sum("mode"), found.free_mass, rtol=1e-9)
    assert (found.free_mass < case.structure.total_mass).all()


@pytest.mark.parametrize("model", MODELS)
def test_responses_of_a_turned_structure(model) -> None:
    """To forces, and to a base that moves along the turned axis by its parts."""
    f, load = np.linspace(0.2, 6.0, 9), np.array([-1.0, 0.2, 0.0])
    plain, oblique = pair(model)
    one = fd.frf(plain, fd.Force([0, 1], load), frequencies=f).receptance.values @ TURN.T
    other = fd.frf(oblique, fd.Force([0, 1], TURN @ load), frequencies=f).receptance.values
    ratio = float(np.abs(one).max() / np.abs(other).max())
    np.testing.assert_allclose(one, ratio * other, atol=1e-7 * np.abs(one).max())
    scale = np.abs(TURN @ load).sum() / np.abs(load).sum()  # they are per unit of these
    assert min(abs(ratio - 1.0), abs(ratio / scale - 1.0)) < 1e-7
    # absolute motions to a base along each old axis, summed to one along a new one
    axes = [
        fd.frf(plain, fd.BaseMotion(axis), frequencies=f).transmissibility.values for axis in "xyz"
    ]
    moved = np.tensordot(TURN[2], axes, 1) @ TURN.T
    found = fd.frf(oblique, fd.BaseMotion("z"), frequencies=f).transmissibility.values
    np.testing.assert_allclose(found, moved, atol=1e-6 * np.abs(moved).max())


@pytest.mark.parametrize("method", ["modal", "impulse", "stepped_sine"])
def test_methods_agree_with_links_and_directions(method) -> None:
    """In the time domain as by matrices."""
    case = chain(alpha=1.5)
    nodes = len(case.structure.nodes)
    supports = [fd.Fix([0]), fd.Fix(list(range(1, nodes)), direction="z"),
                fd.Fix([1], "y"), fd.Link([1, 2], axes="y")]  # fmt: skip
    tied = fd.Case(case.structure, supports, damping=case.damping)
    frequencies = np.arange(0.5, 4.0, 0.5)
    drive = fd.Force([2], (1e-4, 0.0, 0.0))
    exact = fd.frf(case, drive, frequencies=frequencies).receptance.values
    found = fd.frf(tied, drive, frequencies=frequencies, method=method).receptance.values
    close = 1e-9 if method == "modal" else 1e-2
    np.testing.assert_allclose(found, exact, atol=close * np.abs(exact).max())


def test_springs_in_parallel() -> None:
    """Masses m1, m2 on springs k1, k2, linked along the springs: (k1 + k2) / (m1 + m2)."""
    k, length, area = np.array([100.0, 60.0]), 2.0, 1e-4
    s = fd.Structure(
        np.array([[0, 0, 0], [length, 0, 0], [0, 1, 0], [length, 1, 0]], float),
        np.array([[0, 1], [2, 3]]), area * k / k[0], fd.Sheet(k[0] * length / area, 0.3, 0.01),
        node_mass=np.array([1.0, 0.5, 1.0, 0.4]),
    )  # fmt: skip
    case = fd.Case(s, [fd.Fix([0, 2]), fd.Fix([1, 3], "yz"), fd.Link([1, 3], axes="x")])
    found = fd.modes(case, 1)
    expected = np.sqrt(k.sum() / 0.9) / (2.0 * np.pi)
    assert found.frequency.item(0) == pytest.approx(expected, rel=1e-12)
    np.testing.assert_allclose(found["shape"].values[0, [1, 3], 0], 1.0 / np.sqrt(0.9), rtol=1e-12)


def test_bends_of_rigid_panels_are_not_soft() -> None:
    """Only hinges that can turn are counted, and the modes are proper without a secant."""
    supports = [fd.Fix([4, 5]), fd.Fix([0, 1], "z")]

    def case(rigid):
        s = fd.discretize(
            fd.patterns.simple_fold(), SHEET, fold_law="linear", rigid=rigid, preset="herkal"
        )
        return fd.Case(s, supports)

    for rigid, soft in ((None, 8), ([1], 4)):
        with pytest.warns(fd.errors.FoldynWarning, match=f"{soft} hinges of the superlinear law"):
            assert linearize(case(rigid)).soft == soft
    assert linearize(case("all")).soft == 0
    drive = fd.Force([0, 1], (1e-3, 0.0, 0.0))
    direct, balanced = (
        fd.frf(case("all"), drive, frequencies=[1.0], method=method).receptance
        for method in ("direct", "harmonic")
    )
    np.testing.assert_allclose(balanced, direct, rtol=1e-9, atol=1e-12)
