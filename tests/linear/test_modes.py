"""Modes of structures against a dense eigensolver, what comes with them, refusals."""

from __future__ import annotations

from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest
from bodies import PATTERNS, body, flat, hinged_panel, miura, paper_specimen
from scipy.linalg import eigh

import foldyn as fd
from foldyn.algebra import eigen
from foldyn.algebra.solvers import SOLVERS
from foldyn.errors import FoldynWarning, InputError
from foldyn.linear import linearize, modes
from pairwise import in_pairs

STRAIGHT = {"fold_law": "linear", "bend_law": "linear"}


# ------------------------------------------------------------------ a dense eigensolver

SUPPORTS = {"free": [], "hinged": [fd.Fix([0, 1], "xyz")], "held": [fd.Fix([0, 1, 2], "xyz")]}


@pytest.mark.parametrize(
    ("pattern", "scheme", "mass", "held"),
    in_pairs(PATTERNS, ["n5b8", "n4b5"], ["mixed_voronoi", "consistent"], SUPPORTS),
)
def test_frequencies_are_those_of_a_dense_solver(pattern, scheme, mass, held, monkeypatch):
    monkeypatch.setattr(eigen, "DENSE", 0)
    case = fd.Case(body(pattern, scheme, mass, **STRAIGHT), SUPPORTS[held])
    found = modes(case, 15)
    rigid = {"free": 6, "hinged": 1, "held": 0}[held]
    linear = linearize(case)
    values = eigh(flat(linear.stiffness), flat(linear.mass), eigvals_only=True)[:15]
    exact = np.sqrt(values[rigid:]) / (2 * np.pi)
    np.testing.assert_allclose(found.frequency[rigid:], exact, rtol=1e-9)
    assert int(found.rigid.sum()) == rigid
    np.testing.assert_array_equal(found.frequency[:rigid], 0.0)
    assert found.attrs["complete"] == 15 and found.attrs["solver"] == "superlu"
    assert found.attrs["largest_residual"] < 1e-12


def test_the_specimen_against_a_dense_solver():
    case = paper_specimen("consistent")
    found = modes(case, 12, secant=0.5)
    linear = linearize(case, secant=0.5)
    _, shapes = eigh(flat(linear.stiffness), flat(linear.mass), subset_by_index=[0, 11])
    # eigenvalues of a full matrix have the rounding of its largest, 1e8 times these: the
    # Rayleigh quotients of its shapes are free of it
    values = np.einsum("ik,ik->k", shapes, linear.stiffness @ shapes)
    values /= np.einsum("ik,ik->k", shapes, linear.mass @ shapes)
    np.testing.assert_allclose(found.frequency, np.sqrt(values) / (2 * np.pi), rtol=1e-9)
    assert (fd.linear.mac(found["shape"].values.reshape(12, -1)[:, linear.free], shapes.T)
            .diagonal() > 1 - 1e-9).all()  # fmt: skip


@pytest.mark.skipif(not SOLVERS["pardiso"].found(), reason="needs mkl")
def test_backends_agree():
    case = paper_specimen()
    one, other = (modes(case, 8, secant=1.0, solver=name) for name in ("superlu", "pardiso"))
    assert (one.attrs["solver"], other.attrs["solver"]) == ("superlu", "pardiso")
    np.testing.assert_allclose(one.frequency, other.frequency, rtol=1e-9)
    np.testing.assert_allclose(one["shape"], other["shape"], atol=1e-6 * abs(one["shape"]).max())


# ------------------------------------------------------------------ what comes with the shapes


@pytest.mark.parametrize("mass", ["mixed_voronoi", "consistent"])
def test_shapes_are_orthogonal_and_of_unit_modal_mass(mass):
    case = fd.Case(body("miura", mass=mass, **STRAIGHT), [fd.Fix([0, 1, 2], "xyz")])
    found = modes(case, 10)
    shapes = found["shape"].values.reshape(10, -1)
    weights = np.kron(flat(case.structure.mass), np.eye(3))
    np.testing.assert_allclose(shapes @ weights @ shapes.T, np.eye(10), atol=1e-12)
    tangent = flat(case.structure.tangent(np.zeros_like(case.structure.nodes)))
    stiffness = shapes @ tangent @ shapes.T
    scale = found.eigenvalue.values.max()
    np.testing.assert_allclose(stiffness, np.diag(found.eigenvalue), atol=1e-9 * scale)
    assert not shapes[:, case.supported_dofs].any()
    largest = np.take_along_axis(shapes, np.abs(shapes).argmax(axis=1)[:, None], axis=1)
    assert (largest > 0).all()


@pytest.mark.parametrize("mass", ["mixed_voronoi", "consistent"])
def test_effective_masses_add_up_to_the_mass_that_is_free(mass):
    case = fd.Case(body("miura", mass=mass, **STRAIGHT), [fd.Fix([0, 1, 2], "xz")])
    found = modes(case, len(case.free_dofs))
    nodes = [np.flatnonzero(~case.fixed[:, axis]) for axis in range(3)]
    free = [flat(case.structure.mass)[np.ix_(each, each)].sum() for each in nodes]
    np.testing.assert_allclose(found.effective_mass.sum("mode"), free, rtol=1e-10)
    np.testing.assert_allclose(found.attrs["free_mass"], free, rtol=1e-12)
    np.testing.assert_allclose(found.participation**2, found.effective_mass)


def test_rayleigh_damping_ratios():
    case = fd.Case(
        body("miura", **STRAIGHT), [fd.Fix([0, 1, 2], "xyz")], damping=fd.Rayleigh(0.4, 0.003)
    )
    found = modes(case, 8)
    omega = 2 * np.pi * found.frequency.values
    np.testing.assert_allclose(found.damping_ratio, 0.2 / omega + 0.0015 * omega, rtol=1e-8)


def test_modes_are_saved_with_their_case(tmp_path):
    case = fd.Case(body("eggbox", mass="consistent"), [fd.Fix([0, 1], "xyz")])
    found = modes(case, 4, secant=1.0)
    fd.save(found, tmp_path / "modes.nc")
    loaded = fd.load(tmp_path / "modes.nc")
    assert loaded.identical(found) and loaded.rigid.dtype == bool
    assert loaded.attrs["foldyn_result"] == "modes" and loaded.attrs["secant"] == 1.0
    again = modes(fd.case_of(loaded), 4, secant=1.0)
    for name in ("frequency", "shape"):
        np.testing.assert_array_equal(again[name], found[name])


# ------------------------------------------------------------------ refusals


@pytest.mark.parametrize(
    ("options", "message"),
    [
        *(({"count": count}, "count = ") for count in (0, -1, 2.5, True, "6")),
        ({"count": 10}, "only 9 free dofs"),
        ({"solver": "mumps"}, 'solver = "mumps"'),
    ],
)
def test_refused(options, message):
    case, turning = hinged_panel("panel", 1e-4)
    assert modes(case, 3 * len(turning)).sizes["mode"] == 9
    with pytest.raises(InputError, match=message):
        modes(case, **options)


def test_a_missed_mode_is_reported(monkeypatch):
    plain = eigen.lowest

    def lossy(*given, **named):
        return replace(plain(*given, **named), missed=2)

    monkeypatch.setattr(import_module("foldyn.linear.modes"), "lowest", lossy)
    with pytest.warns(FoldynWarning, match="differs by 2 from the modes found"):
        modes(fd.Case(miura()), 3, secant=1.0)
