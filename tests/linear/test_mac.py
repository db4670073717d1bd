"""MAC matrices and pairs of modes."""

from __future__ import annotations

import numpy as np
import pytest
from bodies import body, flat, paper_specimen

import foldyn as fd
from foldyn.errors import InputError
from foldyn.linear import mac, modes, pair_modes

HELD = [fd.Fix([0, 1, 2], "xyz")]
RNG = np.random.default_rng(3)
STRAIGHT = {"fold_law": "linear", "bend_law": "linear"}


def some(modes=4, nodes=6, axes=3):
    return RNG.standard_normal((modes, nodes, axes))


def test_by_hand():
    a = np.array([[[1.0], [0.0]], [[1.0], [1.0]]])
    b = np.array([[[0.0], [2.0]], [[-3.0], [-3.0]], [[1.0], [-1.0]]])
    np.testing.assert_allclose(mac(a, b), [[0, 0.5, 0.5], [0.5, 1, 0]], atol=1e-15)


def test_symmetric_with_a_unit_diagonal_whatever_the_scale():
    a, b = some(), some(3)
    values = mac(a, a)
    np.testing.assert_allclose(values, values.T, rtol=1e-14)
    np.testing.assert_allclose(values.diagonal(), 1.0, rtol=1e-14)
    assert (values >= 0).all() and (values <= 1).all()
    scaled = a * np.array([2.0, -0.3, 1e6, -1e-9])[:, None, None]
    np.testing.assert_allclose(mac(scaled, a), values, rtol=1e-12)
    np.testing.assert_allclose(mac(a, b), mac(b, a).T, rtol=1e-14)
    np.testing.assert_allclose(mac(a[:, :, 0], a[:, :, 0]), mac(a[:, :, :1], a[:, :, :1]))
    a[1] = 0.0  # a shape that does not move
    np.testing.assert_array_equal(np.isnan(mac(a, b)), np.arange(4)[:, None] == [1, 1, 1])


@pytest.mark.parametrize("mass", ["mixed_voronoi", "consistent"])
def test_modes_are_orthogonal_in_the_mass(mass):
    s = body("miura", mass=mass, **STRAIGHT)
    found = modes(fd.Case(s, HELD), 8)
    for given in (s.mass, flat(s.mass), *([s.mass.diagonal()] if mass != "consistent" else [])):
        np.testing.assert_allclose(mac(found, found, mass=given), np.eye(8), atol=1e-12)
    assert np.abs(mac(found, found) - np.eye(8)).max() > 1e-4  # without it they are not


def test_complex_shapes():
    """A phase that is common to a shape plays no part, one within it does."""
    a = some(2)
    np.testing.assert_allclose(mac(a * np.exp(0.7j), a), mac(a, a), rtol=1e-13)
    twisted = a * np.exp(1j * np.arange(6))[None, :, None]
    assert mac(twisted, a)[0, 0] < 0.9
    np.testing.assert_allclose(mac(twisted, twisted).diagonal(), 1.0)


def test_common_nodes_of_two_models():
    """N4B5 and N5B8 share the vertices, whose numbers are the same."""
    five, four = (body("miura", scheme, **STRAIGHT) for scheme in ("n5b8", "n4b5"))
    a, b = (modes(fd.Case(s, HELD), 3) for s in (five, four))
    shared = np.arange(25)
    values = mac(a, b, nodes=shared)
    np.testing.assert_array_equal(values, mac(a["shape"].values[:, :25], b))
    assert values.max() > 0.8
    turned = b["shape"].values[:, ::-1]
    np.testing.assert_array_equal(mac(a, turned, nodes=(shared, shared[::-1])), values)
    with pytest.raises(InputError, match=r"41 nodes .* 25 .* give nodes ="):
        mac(a, b)


def test_pairs():
    a = modes(paper_specimen(), 6, secant=0.1)
    b = modes(paper_specimen(), 6, secant=1.0)
    values = mac(a, b)
    pairs = pair_modes(values)
    # wobble along y and bending along z change places between the two amplitudes
    np.testing.assert_array_equal(pairs.first, range(6))
    assert pairs.second[:4].tolist() == [1, 0, 3, 2]
    assert (pairs.mac[:4] > 0.7).all()
    np.testing.assert_array_equal(pairs.mac, values[pairs.first, pairs.second])
    few = pair_modes(values, least=0.9)
    assert (few.mac >= 0.9).all() and 0 < len(few.first) < 6


def test_pairs_of_the_greatest_sum():
    """The best partner of each would be the same one: the sum decides."""
    pairs = pair_modes([[0.9, 0.8], [0.85, 0.1]])
    assert pairs.second.tolist() == [1, 0]
    assert pair_modes([[0.9], [0.95]]).first.tolist() == [1]


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"a": np.zeros(3), "b": some()}, "a: shape"),
        ({"a": some(), "b": "modes"}, "b: shape"),
        ({"a": some(), "b": some(nodes=5)}, "give nodes ="),
        ({"a": some(), "b": some(), "nodes": [0, 6]}, "no node 6"),
        ({"a": some(), "b": some(), "nodes": [0.5]}, "nodes = "),
        ({"a": some(), "b": some(), "mass": np.ones(5)}, "mass: shape"),
        ({"a": some(), "b": some(), "nodes": [0, 1], "mass": np.ones(6)}, "that are compared"),
    ],
)
def test_refused(given, message):
    with pytest.raises(InputError, match=message):
        mac(given.pop("a"), given.pop("b"), **given)


def test_pairs_refused():
    with pytest.raises(InputError, match="give the matrix of mac"):
        pair_modes([0.5, 0.2])
    path = fd.trace(paper_specimen(rest="as_published"), load_factors=[0.0])
    with pytest.raises(InputError, match="no shapes"):
        mac(path, path)
