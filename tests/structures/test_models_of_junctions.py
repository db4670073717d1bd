"""Models of patterns with edges of three and more panels."""

import numpy as np
import pytest

import foldyn as fd
from foldyn import checks
from foldyn.errors import InputError
from junctions import ANGLES, SHEET, copied, crease_of, stack, star

MODELS = {
    "herkal": lambda p, **more: fd.discretize(p, SHEET, preset="herkal", bend_law="linear", **more),
    "plate": lambda p, **more: fd.discretize(p, SHEET, preset="plate", **more),
    "n5b8e": lambda p, **more: fd.discretize(p, SHEET, preset="n5b8e", **more),
    "shell": lambda p, **more: fd.shell(p, SHEET, divisions=4, **more),
    "superelements": lambda p, **more: fd.superelements(p, SHEET, divisions=8, level=2, **more),
}
EXACT = {"herkal": {"mass": "consistent"}, "shell": {"mass": "consistent"}, "superelements": {}}


def frequencies(structure, held, count=8):
    case = fd.Case(structure, held)
    return fd.modes(case, count, check_model=False).frequency.values


@pytest.mark.parametrize("welded", [False, True])
@pytest.mark.parametrize("model", ["n5b8e", "shell"])
def test_forces_are_the_gradient_and_the_tangent_that_of_forces(model, welded):
    body = MODELS[model](star(ANGLES[:3], welded)).body
    q = 1e-3 * np.random.default_rng(1).standard_normal(body.size)
    assert checks.gradient_error(lambda z: body.energies(z).sum(), body.internal, at=q) < 1e-6
    assert checks.tangent_error(body.internal, body.tangent, at=q) < 1e-5


@pytest.mark.parametrize("model", EXACT)
def test_rigid_panels_on_springs(model):
    """A ring of springs between neighbors, and panels that turn about one line."""
    pattern, stiffness = star(), np.array([0.2, 0.5, 0.3, 0.9])
    structure = MODELS[model](
        pattern, rigid="all", fold_law="linear", crease_stiffness=stiffness.tolist(), **EXACT[model]
    )
    ring = np.zeros((4, 4))
    for k, (one, two) in zip(0.2 * stiffness, pattern.crease_faces, strict=True):
        ring[np.ix_([one, two], [one, two])] += k * np.array([[1.0, -1.0], [-1.0, 1.0]])
    inertia = SHEET.density * SHEET.thickness * 0.2 * 0.1**3 / 3.0
    expected = np.sqrt(np.abs(np.linalg.eigvalsh(ring)) / inertia) / (2.0 * np.pi)
    found = frequencies(structure, [fd.Fix([0, 1])], 4)
    assert found[0] < 1e-3 * expected[1]
    assert found[1:] == pytest.approx(expected[1:], rel=1e-5)


@pytest.mark.parametrize("model", ["n5b8e", "shell", "superelements"])
def test_equal_panels_bend_from_a_line_that_does_not_turn(model):
    """Modes whose moments add up to zero are alike for 2, 3 and 4 panels; there are m - 1."""
    held = [fd.Fix([0, 1], along=model != "n5b8e")]  # whose welds stay straight
    two, three, four = (
        frequencies(MODELS[model](star(np.arange(m) * 360.0 / max(m, 3), True)), held, 4)
        for m in (2, 3, 4)
    )
    assert max(two[0], three[0], four[0]) < 1e-3 * two[1]  # all turn together
    assert three[1:3] == pytest.approx([two[1]] * 2, rel=1e-7)
    assert four[1:4] == pytest.approx([two[1]] * 3, rel=1e-7)


@pytest.mark.parametrize("model", ["shell", "superelements"])
def test_such_modes_are_those_of_a_clamped_panel(model):
    held, pattern = [fd.Fix([0, 1], along=True)], star()
    alone = MODELS[model](fd.Pattern(pattern.vertices[:4], [(0, 1, 3, 2)]), clamped=[(0, 1)])
    found = frequencies(MODELS[model](star(welded=True)), held, 2)
    assert found[1] == pytest.approx(frequencies(alone, held, 1)[0], rel=1e-7)


@pytest.mark.matrix
@pytest.mark.filterwarnings("ignore:pattern. its welds")
@pytest.mark.parametrize("welded", [False, True])
@pytest.mark.parametrize("model", MODELS)
def test_the_same_however_it_is_turned_mirrored_and_numbered(model, welded):
    pattern, rng = star(welded=welded), np.random.default_rng(5)
    stiffness = rng.uniform(0.1, 5.0, len(pattern.creases))
    options = {} if welded else {"crease_stiffness": stiffness.tolist()}
    found = frequencies(MODELS[model](pattern, **options), [fd.Fix([0, 1, 2])])
    for seed in range(3):
        other, number, panel = copied(pattern, seed)
        if not welded:
            rows, here = crease_of(other), number[pattern.creases].tolist()
            edges = [tuple(sorted(pair)) for pair in here]
            pairs = [frozenset(panel[list(both)].tolist()) for both in pattern.crease_faces]
            moved = np.empty(len(stiffness))
            moved[[rows[key] for key in zip(edges, pairs, strict=True)]] = stiffness
            options = {"crease_stiffness": moved.tolist()}
        again = frequencies(MODELS[model](other, **options), [fd.Fix(number[[0, 1, 2]].tolist())])
        np.testing.assert_allclose(again[1:], found[1:], rtol=1e-7)


def test_models_agree():
    """Soft creases: the first modes of superelements, within what the other models state."""
    pattern, held = star(), [fd.Fix([0, 1, 2, 3])]
    best = frequencies(MODELS["superelements"](pattern, crease_stiffness=0.5), held, 3)
    for model, error in (("plate", 0.05), ("n5b8e", 0.03), ("shell", 0.05)):
        found = frequencies(MODELS[model](pattern, crease_stiffness=0.5), held, 3)
        np.testing.assert_allclose(found, best, rtol=error)


@pytest.mark.parametrize(
    "model", [pytest.param(name, marks=pytest.mark.matrix) for name in MODELS if name != "plate"]
    + ["plate"],
)  # fmt: skip
def test_stacked_layers_are_linked_layers(model):
    """Without stiffness between layers, a junction is two creases whose ends are linked."""
    layer, joined = stack()
    top = layer.vertices[:, 2].max()
    other = layer.mirrored("z", about=(0.0, 0.0, top))
    count = len(layer.faces)
    own = (joined.crease_faces < count).all(axis=1) | (joined.crease_faces >= count).all(axis=1)
    soft = np.where(own, 0.02, 1e-12)
    stacked = MODELS[model](joined, crease_stiffness=soft.tolist())
    n = len(layer.vertices)
    apart = fd.Pattern(
        np.concatenate([layer.vertices, other.vertices]),
        [*layer.faces, *(tuple(v + n for v in face) for face in other.faces)],
    )
    linked = MODELS[model](apart, crease_stiffness=0.02)
    ridge = np.flatnonzero(np.isclose(layer.vertices[:, 2], top))
    pairs = [(v, v + n) for v in ridge.tolist()]
    if model == "shell":
        along = {(int(row[0]), int(row[-1])): row for row in linked.edge_nodes}
        pairs = [
            (a, b)
            for one, row in along.items() if {*one} <= {*ridge.tolist()}
            for a, b in zip(row.tolist(), along[one[0] + n, one[1] + n].tolist(), strict=True)
        ]  # fmt: skip
    links = [fd.Link(list(pair)) for pair in dict.fromkeys(pairs)]
    held = [fd.Fix([0, 1, 2])]
    found, expected = frequencies(stacked, held, 6), frequencies(linked, [*held, *links], 6)
    # edges of these models bow between linked vertices, apart from each other
    loose = {"plate": 1e-3, "n5b8e": 0.02, "superelements": 0.05}.get(model, 1e-6)
    np.testing.assert_allclose(found, expected, rtol=loose)


def test_moments_of_creases_balance():
    """A moment on one panel of three, the others held: the springs beside it carry it."""
    pattern, stiffness = star((0.0, 120.0, 240.0)), np.array([0.4, 0.7, 0.9])
    structure = fd.discretize(
        pattern, SHEET, preset="n5b8e", rigid="all", fold_law="linear",
        crease_stiffness=stiffness.tolist(),
    )  # fmt: skip
    force, held = 1e-6, fd.Fix([0, 1, 4, 5, 6, 7])
    case = fd.Case(structure, [held], [fd.Force([2, 3], (0.0, 0.0, 0.5 * force))])
    moments = fd.stresses(fd.trace(case)).crease_moment.values[-1]
    beside = (pattern.crease_faces == 0).any(axis=1)
    shares = np.where(beside, stiffness, 0.0) / stiffness[beside].sum()
    np.testing.assert_allclose(np.abs(moments), shares * force * 0.1 / 0.2, rtol=1e-4, atol=1e-12)
    assert moments[beside].prod() < 0.0  # one opens as the other closes


@pytest.mark.parametrize("model", ["plate", pytest.param("n5b8e", marks=pytest.mark.matrix)])
def test_motions(model):
    """A star let go keeps its energy; contact that nothing touches changes nothing."""
    structure = MODELS[model](star())
    case = fd.Case(structure, [fd.Fix([0, 1, 2, 3])], [fd.Force([4, 5], (0.0, 0.01, 0.02))])
    result = fd.simulate(case, duration=0.02, method="generalized_alpha")
    groups = sum(result[name] for name in ("kinetic", *case.energy_groups))
    error = np.abs(groups - result.work).max()
    assert error < 1e-3 * np.abs(result.work).max()
    touching = fd.simulate(
        case.altered(contact=fd.Contact()), duration=0.02, method="generalized_alpha"
    )
    moved = np.abs(result.displacement).max()
    assert np.abs(touching.displacement - result.displacement).max() < 1e-6 * moved


def test_explicit_methods():
    case = fd.Case(MODELS["n5b8e"](star()), [fd.Fix([0, 1, 2, 3])])
    with pytest.raises(InputError, match=r"method: more than two panels meet at edge \(0, 1\)"):
        fd.simulate(case, duration=1e-3, method="rk4")
    plate = fd.Case(
        MODELS["plate"](star()), [fd.Fix([0, 1, 2, 3])], [fd.Force([4, 5], (0.0, 0.01, 0.02))]
    )
    one = fd.simulate(plate, duration=2e-3, method="rk4").displacement.values[-1]
    other = fd.simulate(plate, duration=2e-3, method="dormand_prince").displacement.values[-1]
    np.testing.assert_allclose(one, other, atol=1e-3 * np.abs(one).max())


@pytest.mark.matrix
@pytest.mark.parametrize("model", ["n5b8e", "shell"])
def test_gradients(model):
    """Of a path, beside differences."""

    def build(first, second, third, width):
        pattern = star((0.0, 110.0, 230.0), width=width)
        structure = MODELS[model](pattern, crease_stiffness=[first, second, third])
        return fd.Case(structure, [fd.Fix([0, 1, 2])], [fd.Force([4], (0.0, 0.02, 0.01))])

    values = {"first": 0.4, "second": 0.7, "third": 0.3, "width": 0.1}
    found = fd.sensitivity(
        build, values, measures=["displacement[6,y]"], analysis={"kind": "statics"}
    )

    def moved(**changed):
        return fd.trace(build(**{**values, **changed})).displacement.values[-1][6, 1]

    for name, value in values.items():
        small = 1e-3 * value
        change = moved(**{name: value + small}) - moved(**{name: value - small})
        gradient = found[f"gradient_{name}"].values[0]
        assert gradient == pytest.approx(change / (2.0 * small), rel=1e-5)


def test_masses_of_panels_are_those_at_creases():
    """The rule of `n5b8e` depends on which edges are creases: at a junction all are."""
    made = [MODELS["n5b8e"](star(angles)) for angles in ((0.0, 120.0), (0.0, 120.0, 240.0))]
    two, three = (np.asarray(one.mass.todense()) for one in made)
    tips = [2, 3]
    np.testing.assert_allclose(two[np.ix_(tips, tips)], three[np.ix_(tips, tips)], rtol=1e-9)


def test_water_takes_no_junctions():
    """The flow has a jump for each panel; panels by themselves have theirs."""
    case = fd.Case(MODELS["plate"](star()), [fd.Fix([0, 1, 2])])
    water = fd.Air(density=1000.0)
    with pytest.raises(InputError, match="several jumps; give added_mass"):
        fd.modes(case.altered(air=water), 2, check_model=False)
    local = fd.modes(
        case.altered(air=fd.Air(density=1000.0, added_mass="local")), 2, check_model=False
    )
    assert local.frequency.values[1] < frequencies(case.structure, [fd.Fix([0, 1, 2])], 2)[1]


def test_strips_at_junctions_are_told():
    """Their panels bend too stiffly, as those of strips between two panels do."""
    from foldyn.structures.beyond_range import _strips

    def wall(count):
        """Long panels, each with a crease in its middle, that meet at an edge."""
        vertices, faces = [(0.0, 0.0, 0.0), (0.1, 0.0, 0.0)], []
        for k in range(count):
            out = np.array([np.cos(2.0 * np.pi * k / 3.0), np.sin(2.0 * np.pi * k / 3.0)])
            n = len(vertices)
            vertices += [(x, *(width * out)) for width in (0.4, 0.8) for x in (0.0, 0.1)]
            faces += [(0, 1, n + 1, n), (n, n + 1, n + 3, n + 2)]
        return fd.Pattern(vertices, faces)

    assert _strips(wall(2)).all()
    assert _strips(wall(3)).all()
