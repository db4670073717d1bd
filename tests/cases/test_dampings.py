"""Kinds of damping and dashpots: what they take, how they are stored, what is refused."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from case_texts import HELD_MIURA_TEXT
from foldyn.cases.document import from_document, to_document
from foldyn.errors import InputError

SHEET = fd.Sheet(1e6, 0.25, 0.01, density=1.0)
S = fd.discretize(fd.patterns.miura(), SHEET, bend_law="linear")
CASE = (
    HELD_MIURA_TEXT
    + """\
[model]
bend_law = "linear"
[analysis]
kind = "modes"
"""
)


def test_one_is_kept_as_given_and_several_add_up():
    one = fd.Rayleigh(0.5)
    assert fd.Case(S, damping=one).damping is one
    assert fd.Case(S, damping=[one]).damping is one
    assert fd.Case(S, damping=[]).damping == fd.Rayleigh()
    both = fd.Case(S, damping=[fd.ModalDamping([0.02, 0.03]), one])
    assert both.rayleigh is one and both.modal_damping.modes == 2 and both.damped
    assert not fd.Case(S, damping=fd.ModalDamping(0.0)).damped
    creases = [fd.CreaseDamping(1.0), fd.CreaseDamping(0.5, [1])]
    assert fd.Case(S, damping=creases).crease_damping.tolist() == [1.0, 1.5, 1.0, 1.0]
    assert fd.Case(S, damping=fd.CreaseDamping(1.0)).rayleigh == fd.Rayleigh()


@pytest.mark.parametrize(
    ("damping", "supports"),
    [
        (fd.Rayleigh(0.1, 0.2, "start"), []),
        (fd.ModalDamping(0.02), []),
        (fd.ModalDamping(0.02, 3, "start"), [fd.Dashpot(1.0, nodes="xmax")]),
        (
            [fd.Rayleigh(0.1), fd.ModalDamping([0.1, 0.2]), fd.CreaseDamping(1e-3)],
            [
                fd.Dashpot(0.5, nodes=[3, 4], direction="-z"),
                fd.Dashpot(0.5, between=(3, 4)),
                fd.Dashpot(0.5, between=[(3, 4), (0, 8)], direction=(1, 2, 0)),
            ],
        ),
        ([fd.Rayleigh(0.1), fd.StrainDamping(1e-4)], []),
        ([fd.CreaseDamping(1e-3, [1, 2]), fd.CreaseDamping(2e-3, "valley")], []),
    ],
)
def test_stored_and_read_back(damping, supports, tmp_path):
    case = fd.Case(S, [fd.Fix("xmin"), *supports], damping=damping)
    document = to_document(case)
    again = from_document(document.sections, document.arrays)
    assert again.damping == case.damping and again.supports == case.supports
    fd.save(fd.modes(case, 2), tmp_path / "modes.nc")
    stored = fd.case_of(fd.load(tmp_path / "modes.nc"))
    assert stored.damping == case.damping and stored.supports == case.supports


@pytest.mark.parametrize(
    ("text", "damping", "supports"),
    [
        ("[damping]\nmodal = 0.02\n", fd.ModalDamping(0.02), ()),
        (
            "[damping]\nmodal = [0.02, 0.03]\nalpha = 0.1\n",
            (fd.Rayleigh(0.1), fd.ModalDamping([0.02, 0.03])),
            (),
        ),
        (
            '[damping]\nmodal = { ratios = 0.02, count = 2, state = "start" }\n',
            fd.ModalDamping(0.02, 2, "start"),
            (),
        ),
        ("[damping]\nstrain = 1e-4\n", fd.StrainDamping(1e-4), ()),
        (
            "[damping]\nstrain = { beta = 1e-4 }\nalpha = 0.1\n",
            (fd.Rayleigh(0.1), fd.StrainDamping(1e-4)),
            (),
        ),
        ("[damping]\ncreases = 0.001\n", fd.CreaseDamping(0.001), ()),
        (
            "[damping]\ncreases = "
            "[{ coefficient = 1e-3, creases = [0] }, { coefficient = 2e-3 }]\n",
            (fd.CreaseDamping(1e-3, [0]), fd.CreaseDamping(2e-3)),
            (),
        ),
        (
            '[[supports]]\nnodes = "xmax"\ndashpot = 0.1\n'
            '[[supports]]\nbetween = [0, 8]\ndashpot = 0.2\ndirection = "-x"\n',
            fd.Rayleigh(),
            (fd.Dashpot(0.1, "xmax"), fd.Dashpot(0.2, between=(0, 8), direction="-x")),
        ),
    ],
)
def test_case_files(text, damping, supports, tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(CASE + text)
    case = fd.read_case(path).case()
    assert case.damping == damping and case.supports[1:] == supports
    assert np.isfinite(fd.read_case(path).run().damping_ratio).all()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[damping]\nmodal = -1\n", "damping.modal = -1: must be at least 0"),
        ("[damping]\nmodal = []\n", r"damping.modal = \[\]: must be a number, or a list"),
        ("[damping]\nmodal = { ratio = 1 }\n", "damping.modal.ratio: .*did you mean 'ratios'"),
        ("[damping]\nmodal = { count = 1 }\n", "damping.modal.ratios: missing"),
        ("[damping]\nmodal = { ratios = [0.1], count = 1 }\n", "damping.modal.count = 1: .*leave"),
        ("[damping]\nstrain = -1\n", "damping.strain = -1: must be at least 0"),
        ("[damping]\ncreases = [99]\n", r"damping.creases = \[99\]: must be a number"),
        ("[damping]\ncreases = { coefficient = 1, creases = [99] }\n", "crease 99 is out of range"),
        ("[damping]\ncreases = [{ coefficient = 1 }, {}]\n", r"creases\[1\].coefficient: missing"),
        (
            "[[supports]]\nbetween = [0, 8]\n",
            r"supports\[1\].stiffness: missing; give it \(N/m\) for springs, or dashpot",
        ),
        ("[[supports]]\ndashpot = 1\n", r"supports\[1\].nodes: give either nodes"),
        ("[[supports]]\ndashpot = 1\nnodes = [1]\nbetween = [1, 2]\n", "between: give either"),
        ("[[supports]]\ndashpot = 1\nbetween = [1]\n", r"between = \[1\]: must be two nodes"),
        ("[[supports]]\ndashpot = 1\nbetween = [3, 3]\n", r"\[3, 3\]: node 3 is listed twice"),
        ("[[supports]]\ndashpot = 1\nbetween = [3, 99]\n", "node 99 is out of range"),
        ("[[supports]]\ndashpot = -1\nnodes = [1]\n", "dashpot = -1: must be at least 0"),
        (
            '[[supports]]\ndashpot = 1\nnodes = [1]\ndirection = "w"\n',
            '"w": choose one of',
        ),
        ("[[supports]]\ndashpot = 1\nnodes = [1]\ndirection = [0, 0, 0]\n", "must not be zero"),
        ('[[supports]]\ndashpot = 1\nnodes = [1]\naxes = "x"\n', "leave out axes"),
    ],
)
def test_wrong_case_files(text, words, tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(CASE + text)
    with pytest.raises(InputError, match=words):
        fd.read_case(path)


@pytest.mark.parametrize(
    ("damping", "words"),
    [
        (0.1, r"damping = 0.1: must be Rayleigh\(...\) or ModalDamping"),
        ([fd.Rayleigh(), "modal"], 'damping = "modal"'),
        ([fd.Rayleigh(), fd.Rayleigh(1.0)], "give one Rayleigh, not several"),
        ([fd.ModalDamping(0.1), fd.ModalDamping(0.1)], "give one ModalDamping"),
        (fd.CreaseDamping(1.0, [4]), "damping.creases = .*crease 4 is out of range"),
    ],
)
def test_wrong_damping(damping, words):
    with pytest.raises(InputError, match=words):
        fd.Case(S, damping=damping)


def test_nodes_in_one_place_need_a_direction():
    nodes = np.array([[0.0, 0, 0], [1, 0, 0], [1, 0, 0]])
    sheet = fd.Sheet(1.0, 0.3, 0.01)
    s = fd.Structure(nodes, np.array([[0, 1], [0, 2]]), np.ones(2), sheet, node_mass=np.ones(3))
    with pytest.raises(InputError, match=r"supports\[0\].between: nodes 1 and 2 are in one place"):
        fd.Case(s, [fd.Dashpot(1.0, between=(1, 2))])
    fd.Case(s, [fd.Dashpot(1.0, between=(1, 2), direction="x")])


def test_more_ratios_than_modes_that_swing():
    """A free sheet of 13 nodes has 39 - 6 of them; rigid motions are not counted."""
    case = fd.Case(S, damping=fd.ModalDamping(0.02, 33))
    assert fd.modes(case, 39).damping_ratio.values[6:] == pytest.approx(np.full(33, 0.02))
    with pytest.raises(InputError, match="ratios of 34 modes, but only 33 swing"):
        fd.modes(fd.Case(S, damping=fd.ModalDamping(0.02, 34)), 2)


def test_hinges_without_slope_are_told():
    """Superlinear bends at rest: modes that only they resist are left out, with a warning."""
    s = fd.discretize(fd.patterns.miura(), SHEET, preset="herkal")
    case = fd.Case(s, [fd.Fix("xmin")], damping=fd.ModalDamping(0.02, 2))
    with pytest.warns(fd.errors.FoldynWarning, match="damping: .* modal damping leaves them out"):
        fd.simulate(case, 0.01)


@pytest.mark.parametrize("kind", [fd.Spring, fd.Dashpot])
def test_springs_and_dashpots_take_ends_alike(kind):
    """Lines shorter than 1e-9 of the structure have no direction; ends on the ground are -1."""
    for apart, fine in ((5e-10, False), (5e-9, True)):
        nodes = np.array([[0.0, 0, 0], [1, 0, 0], [1, apart, 0]])
        sheet = fd.Sheet(1.0, 0.3, 0.01)
        s = fd.Structure(nodes, np.array([[0, 1], [0, 2]]), np.ones(2), sheet, node_mass=np.ones(3))
        if fine:
            assert kind(1.0, between=(1, 2)).ends(s, "").tolist() == [[1, 2]]
            continue
        with pytest.raises(InputError, match=r"supports\[3\]\.between.*1.*2"):
            kind(1.0, between=(1, 2)).ends(s, "supports[3]")
    assert kind(1.0, nodes=[2, 0]).ends(s, "").tolist() == [[2, -1], [0, -1]]
    assert kind(1.0, nodes=[2]).directions.tolist() == np.eye(3).tolist()
    assert kind(1.0, nodes=[2], direction="-y").directions.tolist() == [[0, -1, 0]]
    assert kind(1.0, between=(0, 1)).directions is None
