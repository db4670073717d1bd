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
CASE = f"""{HELD_MIURA_TEXT}[model]
bend_law = "linear"
[analysis]
kind = "modes"
"""


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


DASHPOTS = [
    fd.Dashpot(0.5, nodes=[3, 4], direction="-z"),
    fd.Dashpot(0.5, between=(3, 4)),
    fd.Dashpot(0.5, between=[(3, 4), (0, 8)], direction=(1, 2, 0)),
]


@pytest.mark.parametrize(
    ("damping", "supports"),
    [
        (fd.Rayleigh(0.1, 0.2, "initial"), []),
        (fd.ModalDamping(0.02), []),
        (fd.ModalDamping(0.02, 3, "initial"), [fd.Dashpot(1.0, nodes="xmax")]),
        ([fd.Rayleigh(0.1), fd.ModalDamping([0.1, 0.2]), fd.CreaseDamping(1e-3)], DASHPOTS),
        ([fd.Rayleigh(0.1), fd.StrainDamping(1e-4)], []),
        ([fd.CreaseDamping(1e-3, [1, 2]), fd.CreaseDamping(2e-3, "valley")], []),
    ],
)
def test_stored_and_read_back(damping, supports, kept):
    case = fd.Case(S, [fd.Fix("xmin"), *supports], damping=damping)
    document = to_document(case)
    for again in (
        from_document(document.sections, document.arrays), kept(fd.modes(case, 2))
    ):  # fmt: skip
        assert again.damping == case.damping and again.supports == case.supports


TWO = fd.ModalDamping([0.02, 0.03])
EACH = "[{ coefficient = 1e-3, creases = [0] }, { coefficient = 2e-3 }]"


@pytest.mark.parametrize(
    ("text", "damping"),
    [
        ("modal = 0.02", fd.ModalDamping(0.02)),
        ("modal = [0.02, 0.03]\nalpha = 0.1", (fd.Rayleigh(0.1), TWO)),
        (
            'modal = { ratios = 0.02, count = 2, state = "initial" }',
            fd.ModalDamping(0.02, 2, "initial"),
        ),
        ("strain = 1e-4", fd.StrainDamping(1e-4)),
        ("strain = { beta = 1e-4 }\nalpha = 0.1", (fd.Rayleigh(0.1), fd.StrainDamping(1e-4))),
        ("creases = 0.001", fd.CreaseDamping(0.001)),
        (f"creases = {EACH}", (fd.CreaseDamping(1e-3, [0]), fd.CreaseDamping(2e-3))),
    ],
)
def test_dampings_in_case_files(text, damping, read):
    case_file = read(f"{CASE}[damping]\n{text}\n")
    assert case_file.case().damping == damping
    assert np.isfinite(case_file.run().damping_ratio).all()


def test_dashpots_in_case_files(read):
    case_file = read(f"""{CASE}[[supports]]
nodes = "xmax"
dashpot = 0.1
[[supports]]
between = [0, 8]
dashpot = 0.2
direction = "-x"
""")
    wanted = (fd.Dashpot(0.1, "xmax"), fd.Dashpot(0.2, between=(0, 8), direction="-x"))
    assert case_file.case().supports[1:] == wanted
    assert np.isfinite(case_file.run().damping_ratio).all()


@pytest.mark.parametrize(
    ("section", "text", "words"),
    [
        ("[damping]", "modal = -1", "damping.modal = -1: must be at least 0"),
        ("[damping]", "modal = []", r"damping.modal = \[\]: must be a number, or a list"),
        ("[damping]", "modal = { ratio = 1 }", "damping.modal.ratio: .*did you mean 'ratios'"),
        ("[damping]", "modal = { count = 1 }", "damping.modal.ratios: missing"),
        ("[damping]", "modal = { ratios = [0.1], count = 1 }", "modal.count = 1: .*leave"),
        ("[damping]", "strain = -1", "damping.strain = -1: must be at least 0"),
        ("[damping]", "creases = [99]", r"damping.creases = \[99\]: must be a number"),
        ("[damping]", "creases = { coefficient = 1, creases = [99] }", "crease 99 is out of range"),
        ("[damping]", "creases = [{ coefficient = 1 }, {}]", r"\[1\].coefficient: missing"),
        ("[[supports]]", "between = [0, 8]", r"\[1\].stiffness: missing; give it"),
        ("[[supports]]", "dashpot = 1", r"supports\[1\].nodes: give either nodes"),
        ("[[supports]]", "dashpot = 1\nnodes = [1]\nbetween = [1, 2]", "between: give either"),
        ("[[supports]]", "dashpot = 1\nbetween = [1]", r"between = \[1\]: must be two nodes"),
        ("[[supports]]", "dashpot = 1\nbetween = [3, 3]", r"\[3, 3\]: node 3 is listed twice"),
        ("[[supports]]", "dashpot = 1\nbetween = [3, 99]", "node 99 is out of range"),
        ("[[supports]]", "dashpot = -1\nnodes = [1]", "dashpot = -1: must be at least 0"),
        ("[[supports]]", 'dashpot = 1\nnodes = [1]\ndirection = "w"', '"w": choose one of'),
        ("[[supports]]", "dashpot = 1\nnodes = [1]\ndirection = [0, 0, 0]", "must not be zero"),
        ("[[supports]]", 'dashpot = 1\nnodes = [1]\naxes = "x"', "leave out axes"),
    ],
)
def test_wrong_case_files(section, text, words, read):
    with pytest.raises(InputError, match=words):
        read(f"{CASE}{section}\n{text}\n")


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
        fd.simulate(case, 0.01, method="rk4")


@pytest.mark.parametrize("kind", [fd.Spring, fd.Dashpot])
def test_springs_and_dashpots_take_ends_alike(kind):
    """Lines shorter than 1e-9 of the structure have no direction; ends on the ground are -1."""
    bars, sheet = np.array([[0, 1], [0, 2]]), fd.Sheet(1.0, 0.3, 0.01)
    near, apart = (
        fd.Structure(np.array([[0.0, 0, 0], [1, 0, 0], [1, y, 0]]), bars, np.ones(2), sheet)
        for y in (5e-10, 5e-9)
    )
    with pytest.raises(InputError, match=r"supports\[3\]\.between.*1.*2"):
        kind(1.0, between=(1, 2)).ends(near, "supports[3]")
    kind(1.0, between=(1, 2), direction="x").ends(near, "")
    assert kind(1.0, between=(1, 2)).ends(apart, "").tolist() == [[1, 2]]
    assert kind(1.0, nodes=[2, 0]).ends(apart, "").tolist() == [[2, -1], [0, -1]]
    assert kind(1.0, nodes=[2]).directions.tolist() == np.eye(3).tolist()
    assert kind(1.0, nodes=[2], direction="-y").directions.tolist() == [[0, -1, 0]]
    assert kind(1.0, between=(0, 1)).directions is None


def test_the_pair_of_the_paper():
    """13.5 % at 9.3 Hz and 9 % at 16.7 Hz (Herkal et al., section 7): 14.4 1/s and 4.1e-4 s."""
    damping = fd.Rayleigh.from_ratios(9.3, 0.135, f2=16.7, z2=0.09)
    assert (damping.alpha, damping.beta) == pytest.approx((14.4, 4.1e-4), rel=2e-3)


@pytest.mark.parametrize("seed", range(20))
def test_the_ratios_come_back(seed):
    random = np.random.default_rng(seed)
    alpha, beta = random.uniform(0.0, 30.0), random.uniform(0.0, 1e-2)
    f1, f2 = random.uniform(0.1, 50.0, 2)
    z1, z2 = (alpha / (4 * np.pi * f) + beta * np.pi * f for f in (f1, f2))
    found = fd.Rayleigh.from_ratios(f1, z1, f2=f2, z2=z2, state="initial")
    assert (found.alpha, found.beta) == pytest.approx((alpha, beta), rel=1e-9, abs=1e-12)
    assert found.state == "initial"


def test_alone():
    """Ratios as of one of the two: exactly zero, or its rounding, for the other."""
    one = fd.Rayleigh.from_ratios(2.0, 0.1, f2=4.0, z2=0.05)
    assert one.beta == pytest.approx(0.0, abs=1e-17) and one.alpha == pytest.approx(0.8 * np.pi)
    other = fd.Rayleigh.from_ratios(4.0, 0.1, f2=2.0, z2=0.05)
    assert other.alpha == pytest.approx(0.0, abs=1e-15)


def test_modes_have_them():
    held = [fd.Fix("xmin", "xyz")]
    f = fd.modes(fd.Case(S, held), 3).frequency.values
    damping = fd.Rayleigh.from_ratios(f[0], 0.02, f2=f[2], z2=0.05)
    ratios = fd.modes(fd.Case(S, held, damping=damping), 3).damping_ratio.values
    assert ratios[[0, 2]] == pytest.approx([0.02, 0.05], rel=1e-9)
    assert ratios[1] < 0.05


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ((1, 0.1, 2, 0.3), r"z2 = 0.3: .* between 0.05 \(alpha alone\) and 0.2 \(beta alone\)"),
        ((2, 0.1, 1, 0.01), r"z2 = 0.01: .* between 0.05 \(beta alone\) and 0.2 \(alpha alone\)"),
        ((1, 0.1, 1, 0.1), "f2 = 1: must differ from f1"),
        ((0, 0.1, 1, 0.1), "f1 = 0: must be greater than 0"),
        ((1, -0.1, 2, 0.1), "z1 = -0.1: must be at least 0"),
        ((1, "a", 2, 0.1), 'z1 = "a"'),
    ],
)
def test_ratios_that_cannot_be_had(given, words):
    with pytest.raises(InputError, match=words):
        fd.Rayleigh.from_ratios(*given[:2], f2=given[2], z2=given[3])
