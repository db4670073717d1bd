"""Superelements against shells on the same mesh, and their estimates of errors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import foldyn as fd
from foldyn.cli.main import main
from foldyn.condensation.shapes import LEVELS
from foldyn.errors import InputError, ModelRangeWarning
from foldyn.linear import linearize

SHEET = fd.Sheet(1e9, 0.3, 0.01, 1000.0)
PATTERN = fd.patterns.miura(cells=(1, 1), panel_angle=55, dihedral=100)
TIP = int(np.argmax(PATTERN.vertices[:, 0]))
HELD = [fd.Fix("xmin", along=True)]
MESH = 8
CREASE, TOP = (3, 4), (5, 8)  # edges


def both(pattern=PATTERN, sheet=SHEET, level=5, divisions=MESH, **options):
    """Superelements, and the shell whose panels they condense."""
    options |= {"divisions": divisions}
    radius = float(np.max(sheet.values("thickness", len(pattern.faces))))
    return (
        fd.superelements(pattern, sheet, level=level, **options),
        fd.shell(pattern, sheet, mass="consistent", vertex_radius=radius, **options),
    )


def frequencies(structure, supports=HELD, count=8, **parts):
    return fd.modes(fd.Case(structure, supports, **parts), count, verify=False)["frequency"].values


@pytest.mark.matrix
@pytest.mark.parametrize("supports", [HELD, [fd.Fix("xmin")], []], ids=["along", "nodes", "free"])
def test_levels_fall_toward_the_shell(supports):
    shell = frequencies(both()[1], supports, 12)
    found = [frequencies(both(level=k)[0], supports, 12) for k in range(1, len(LEVELS) + 1)]
    elastic = shell > 0.01
    assert elastic.sum() == (12 if supports else 6)
    off = np.array(found)[:, elastic] / shell[elastic] - 1.0
    assert (off > -1e-4).all()  # more shapes only soften
    assert (np.diff(off, axis=0) < 1e-6).all()
    assert off[0].max() < 0.12 and off[2].max() < 0.02 and off[4].max() < 0.006


@pytest.mark.matrix
def test_panels_vibrate_between_held_vertices():
    tower = fd.patterns.kresling(sides=5, height=0.9, twist=35)
    sheet = replace(SHEET, thickness=0.02)
    every = np.arange(len(tower.vertices)).tolist()
    own, shell = (frequencies(s, [fd.Fix(every)], 4) for s in both(tower, sheet, divisions=4))
    np.testing.assert_allclose(own, shell, rtol=5e-3)


def test_a_free_sheet_has_six_rigid_modes_and_its_mass():
    structure = both()[0]
    modes = fd.modes(fd.Case(structure), 7)
    assert modes["rigid"].values.tolist() == 6 * [True] + [False]
    assert modes["frequency_error"].values[:6].tolist() == 6 * [0.0]
    np.testing.assert_allclose(modes["effective_mass"].sum("mode"), structure.total_mass, rtol=1e-8)


@pytest.mark.matrix
@pytest.mark.parametrize(
    "case",
    [
        lambda s: fd.Case(s, HELD, masses=[fd.PointMass([TIP], 20.0)]),
        lambda s: fd.Case(s, [*HELD, fd.Spring(300.0, nodes=[TIP])]),
        lambda s: fd.Case(s, [*HELD, fd.Link([5, 7], "z")]),
    ],
    ids=["mass", "spring", "link"],
)
def test_parts_at_vertices(case):
    own, shell = (fd.modes(case(s), 5)["frequency"].values for s in both())
    np.testing.assert_allclose(own, shell, rtol=3e-3)


def test_rigid_motions_move_the_same_water_as_in_other_models():
    water = fd.Air(density=998.0)
    made, bars = both(level=1)[0], fd.discretize(PATTERN, SHEET, scheme="n4b5")
    motions, n = rigid_motions(made), made.nodes.size
    own, other = (fd.Case(s, air=water).added_mass() for s in (made, bars))
    exact = motions[:n].T @ (other @ motions[:n])
    found = motions.T @ (own @ motions)
    np.testing.assert_allclose(found, exact, atol=1e-9 * np.abs(exact).max())


@pytest.mark.matrix
@pytest.mark.parametrize("added", [True, "local"])
def test_modes_in_water(added):
    water = fd.Air(density=998.0, added_mass=added)
    own, shell = (fd.modes(fd.Case(s, HELD, air=water), 4) for s in both())
    np.testing.assert_allclose(own["frequency"], shell["frequency"], rtol=5e-3)
    np.testing.assert_allclose(own["air_share"], shell["air_share"], atol=1e-3)
    np.testing.assert_allclose(own["effective_mass"], shell["effective_mass"], rtol=0.03, atol=2.0)


@pytest.mark.matrix
@pytest.mark.parametrize(
    "options",
    [{"clamped": "xmin"}, {"rigid": [1]}, {"crease_stiffness": 40.0}, {"fold_law": "linear"}],
    ids=lambda one: next(iter(one)),
)
def test_options_mean_what_they_mean_for_shells(options):
    own, shell = (frequencies(s, count=6) for s in both(divisions=4, **options))
    np.testing.assert_allclose(own, shell, rtol=4e-3)


@pytest.mark.matrix
def test_panels_of_different_sheets():
    sheet = replace(SHEET, panels=[fd.PanelSheet([0, 3], thickness=0.02, youngs_modulus=2e9)])
    own, shell = (frequencies(s, count=6) for s in both(sheet=sheet, divisions=4))
    np.testing.assert_allclose(own, shell, rtol=6e-3)


@pytest.mark.matrix
def test_thick_panels():
    """Boards six times as long as thick, whose corners are rigid over a third of the creases."""
    place = [(0.5 * k, y) for y in (0.0, 0.3) for k in range(4)]
    faces = [(k, k + 1, k + 5, k + 4) for k in range(3)]
    boards = fd.thicken(fd.Pattern(place, faces, {(1, 5): "V", (2, 6): "M"}), 0.05)
    sheet = replace(SHEET, thickness=0.05)
    own, shell = both(boards, sheet, clamped="xmin")
    np.testing.assert_allclose(frequencies(own), frequencies(shell), rtol=2e-3)
    weight = on_rigid_motions(own, fd.Gravity((0.0, 0.0, 1.0)))[2]
    mass = fd.modes(fd.Case(own), 7)["effective_mass"].sum("mode").values
    np.testing.assert_allclose([weight, *mass], 1.5 * 0.3 * sheet.areal_density, rtol=1e-7)


@pytest.mark.matrix
def test_a_weld_continues_the_sheet():
    grid = np.array([[i, j, 0.0] for j in (0.0, 1.0) for i in (0.0, 0.8, 2.0)])
    faces = [(0, 1, 4, 3), (1, 2, 5, 4)]
    welded = fd.Pattern(grid, faces, welds=[(1, 4)])
    single = fd.Pattern(grid[[0, 2, 5, 3]], [(0, 1, 2, 3)])
    held = [fd.Fix("xmin", along=True)]
    own, shell = (frequencies(s, held, 4) for s in both(welded, clamped="xmin"))
    np.testing.assert_allclose(own, shell, rtol=5e-3)
    whole = frequencies(both(single, clamped="xmin")[0], held, 4)
    np.testing.assert_allclose(own, whole, rtol=0.03)


@pytest.mark.matrix
def test_oblique_supports_hold_like_turned_ones():
    c, s = np.cos(0.7), np.sin(0.7)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    left = np.flatnonzero(PATTERN.vertices[:, 0] < 1e-9).tolist()
    plain = fd.superelements(PATTERN, SHEET, level=2, divisions=4)
    turned = fd.Pattern(PATTERN.vertices @ turn.T, PATTERN.faces)
    oblique = fd.superelements(turned, SHEET, level=2, divisions=4)
    straight = [fd.Fix(left, "xz", along=True), fd.Fix(left[:1], "y")]
    along = [fd.Fix(left, direction=tuple(turn[:, 0]), along=True), fd.Fix(left, "z", along=True)]
    along.append(fd.Fix(left[:1], direction=tuple(turn[:, 1])))
    np.testing.assert_allclose(frequencies(plain, straight), frequencies(oblique, along), rtol=1e-7)


@pytest.mark.matrix
@pytest.mark.parametrize("stiffer", [1.0, 30.0, 1000.0])
def test_damping_of_creases(stiffer):
    stiffness = stiffer * fd.superelements(PATTERN, SHEET).fold_stiffness
    damping = fd.CreaseDamping(1e-3 * float(stiffness.max()))
    own, shell = (
        fd.modes(fd.Case(s, HELD, damping=damping), 5)["damping_ratio"].values
        for s in both(crease_stiffness=stiffness.tolist(), divisions=4)
    )
    np.testing.assert_allclose(own, shell, rtol=0.02)


@pytest.mark.matrix
def test_creases_that_remember_turn_unevenly_too():
    """A branch that relaxes at once is a damper: the ratios of both are alike."""
    k, time = 1.0, 1e-3
    law = fd.materials.Prony(ratios=[1.0], times=[time], law="linear")
    damped, relaxing = (
        fd.Case(fd.superelements(PATTERN, SHEET, crease_stiffness=k, **law), HELD, damping=damping)
        for law, damping in (({}, fd.CreaseDamping(k * time)), ({"fold_law": law}, ()))
    )
    one, other = (fd.modes(case, 4) for case in (damped, relaxing))
    np.testing.assert_allclose(other["damping_ratio"], one["damping_ratio"], rtol=1e-3)
    np.testing.assert_allclose(other["frequency"], one["frequency"], rtol=1e-4)


DAMPED = [fd.Rayleigh(0.02, 1e-4), fd.ModalDamping(0.02, count=8)]
DAMPED.append(fd.ModalDamping(0.02, count=8, state="initial"))


@pytest.mark.matrix
@pytest.mark.parametrize("damping", DAMPED)
def test_responses_are_sums_of_modes(damping):
    case = fd.Case(fd.superelements(PATTERN, SHEET, level=2, divisions=MESH), HELD, damping=damping)
    found = fd.modes(case, 8)
    if isinstance(damping, fd.ModalDamping):
        np.testing.assert_allclose(found["damping_ratio"], 0.02, rtol=1e-6)
    push, peak = fd.Force([TIP], (0.3, 0.1, 1.0)), float(found["frequency"][0])
    direct, modal = (
        fd.frf(
            case, push, frequencies=peak * np.array([0.5, 0.95, 1.0, 1.05]), method=method
        )["receptance"].values
        for method in ("direct", "modal")
    )  # fmt: skip
    np.testing.assert_allclose(direct, modal, atol=1e-6 * np.abs(direct).max())
    size = np.abs(direct).max(axis=(1, 2))
    assert size[2] > size[[0, 1, 3]].max()


def test_a_base_moves_all_that_stands_on_it():
    """Slowly as a whole; and as forces of inertia say: x = t + H (w^2 M t)."""
    case = fd.Case(
        fd.superelements(PATTERN, SHEET, level=2, divisions=MESH), HELD, damping=fd.Rayleigh(0.05)
    )
    base, omega = fd.BaseMotion("z"), 2.0 * np.pi * 0.3
    still, found = fd.frf(case, base, frequencies=[0.0, 0.3])["transmissibility"].values
    np.testing.assert_allclose(still, np.tile([0.0, 0.0, 1.0], (len(still), 1)), atol=1e-8)
    linear = linearize(case)
    impedance = (linear.stiffness - omega**2 * linear.mass + 1j * omega * linear.damping).toarray()
    load = (omega**2 - 1j * omega * 0.05) * linear.inertia[:, 2]
    moved = linear.expanded(np.linalg.solve(impedance, load)[:, None]).reshape(-1, 3)
    moved[:, 2] += 1.0
    np.testing.assert_allclose(found, moved, atol=1e-8 * np.abs(moved).max())


@pytest.mark.matrix
@pytest.mark.parametrize("method", ["direct", "modal"])
def test_responses_with_creases_that_relax(method):
    push = fd.Force([TIP], (0.0, 0.0, 1.0))
    law = fd.Prony([0.4], [0.1])
    own, shell = (
        fd.frf(
            fd.Case(s, HELD, damping=fd.Rayleigh(alpha=0.3)), drive=[push],
            frequencies=[0.3, 0.7, 1.1], method=by,
        )["receptance"].values[:, TIP]
        for s, by in zip(both(fold_law=law), (method, "direct"), strict=True)
    )  # fmt: skip
    np.testing.assert_allclose(own, shell, atol=6e-3 * np.abs(shell).max())


@pytest.mark.matrix
def test_responses_say_how_far_they_hold():
    case = fd.Case(fd.superelements(PATTERN, SHEET, level=1), HELD, damping=fd.Rayleigh(alpha=1.0))
    modes = fd.modes(case, 10)
    doubtful = modes["frequency"].values[modes["frequency_error"] > 0.05 * modes["frequency"]]
    push = [fd.Force([TIP], (0.0, 0.0, 1.0))]
    low = 0.5 * float(doubtful[0])
    assert fd.frf(case, drive=push, frequencies=[low]).attrs["holds_to"] == low
    with pytest.warns(ModelRangeWarning, match="hold up to"):
        high = fd.frf(case, frequencies=[2.0 * float(doubtful[0])], drive=push)
    assert high.attrs["holds_to"] == pytest.approx(float(doubtful[0]))


@pytest.mark.matrix
def test_participation_includes_parts_that_move_with_supports():
    own, shell = (fd.modes(fd.Case(s, HELD), 3) for s in both())
    np.testing.assert_allclose(own["effective_mass"], shell["effective_mass"], rtol=0.03, atol=0.05)


@pytest.mark.matrix
def test_shapes_between_vertices():
    own, shell = (fd.modes(fd.Case(s, HELD), 5) for s in both())
    nodes = both()[1].nodes
    away = np.linalg.norm(nodes - own["between_position"].values[:, None], axis=2)
    found = away.min(axis=1) < 1e-9  # middles of edges, and of panels
    assert found.sum() == len(PATTERN.lines) + len(PATTERN.faces)
    for mine, theirs in zip(own["between_shape"], shell["shape"], strict=True):
        a, b = mine.values[found].ravel(), theirs.values[away.argmin(axis=1)[found]].ravel()
        np.testing.assert_allclose(a, np.sign(a @ b) * b, atol=0.01 * np.abs(b).max())


@pytest.mark.matrix
@pytest.mark.parametrize(
    "load",
    [
        fd.Force([TIP], (0.0, 0.0, 1e-3)),
        fd.Gravity((1e-5, 2e-5, -3e-5)),
        fd.Pressure(1e-3),
        fd.Pressure(1e-3, panels=[2]),
        fd.LineLoad([CREASE, TOP], (1e-3, 2e-3, 3e-3)),
        fd.TotalForce((1e-3, 2e-3, -1e-3), edges=[TOP]),
        fd.TotalForce((1e-3, 2e-3, -1e-3), panels=[1, 2]),
        fd.CreaseMoment([1, 2], [1e-3, -2e-3]),
        fd.Actuate([0, 1], [260.01, 128.58]),
        fd.Temperature(1e-3, expansion=1e-3),
        fd.Temperature(1e-3, curvature=0.1, panels=[0, 1]),
    ],
    ids=lambda load: type(load).__name__,
)
@pytest.mark.filterwarnings("ignore:the pressure acts on panels with free edges")
def test_small_static_loads(load):
    own, shell = (
        fd.trace(
            fd.Case(s, HELD, [load], masses=[fd.PointMass([TIP], 5.0)]), "newton",
            load_factors=[1.0],
        )["displacement"].values[-1, : len(PATTERN.vertices)]
        for s in both()
    )  # fmt: skip
    most = 5e-3 if isinstance(load, fd.Temperature) else 2e-3
    np.testing.assert_allclose(own, shell, atol=most * np.abs(shell).max())


def rigid_motions(structure):
    """Unit translations of all dofs, and rotations by 1 rad about the origin, (m, 6)."""
    rotated = np.concatenate([np.cross(np.eye(3), x).T for x in structure.nodes])
    rotated = np.concatenate([rotated, structure.body.sheet.rotated])
    moved = np.zeros(rotated.shape)
    moved[: structure.nodes.size] = np.tile(np.eye(3), (len(structure.nodes), 1))
    return np.hstack([moved, rotated])


def on_rigid_motions(structure, load):
    """Work of a load in `rigid_motions`."""
    return structure.spread(load.distributed(structure, ""), {}) @ rigid_motions(structure)


def test_forces_and_moments_of_loads_are_exact():
    structure, force = both(level=2)[0], np.array([1.0, 2.0, 3.0])
    for load, x in (
        (fd.LineLoad([TOP], force), PATTERN.vertices[list(TOP)].mean(axis=0)),
        (fd.TotalForce(force, edges=[CREASE]), PATTERN.vertices[list(CREASE)].mean(axis=0)),
        (fd.TotalForce(force, panels=[2]), PATTERN.vertices[list(PATTERN.faces[2])].mean(axis=0)),
    ):
        exact = np.append(force, np.cross(x, force))
        np.testing.assert_allclose(on_rigid_motions(structure, load), exact, atol=1e-8)
    for load in (fd.CreaseMoment("all", 1.0), fd.Temperature(1.0, 1e-6, 1e-3)):
        forces = structure.spread(load.distributed(structure, ""), {})
        left = on_rigid_motions(structure, load)
        np.testing.assert_allclose(left, 0.0, atol=1e-9 * np.abs(forces).sum())


def isostatic(pattern, loads, **options):
    """Final displacement and energies of superelements whose first panel is held in place."""
    supports = [fd.Fix([0], "xyz"), fd.Fix([1], "xz"), fd.Fix([2], "z")]
    case = fd.Case(fd.superelements(pattern, SHEET, divisions=MESH, **options), supports, loads)
    found = fd.trace(case, "newton", load_factors=[1.0])
    return [found[name].values[-1] for name in ("displacement", "strain_panels", "strain_folds")]


def test_warm_panels_grow_and_curl_without_stress():
    corners = np.array([(0.0, 0.0, 0.0), (0.0, -1.0, 0.0), (1.0, -0.8, 0.0), (1.1, 0.1, 0.0)])
    strain, curvature = 2e-5, 2e-4
    warm = fd.Temperature(2.0, 0.5 * strain, 0.5 * curvature)
    found, energy, _ = isostatic(fd.Pattern(corners, [(0, 1, 2, 3)]), [warm], level=1)
    height = 0.5 * curvature * (corners**2).sum(axis=1)
    plane = np.c_[np.ones(4), corners[:, :2]]
    height -= plane @ np.linalg.solve(plane[:3], height[:3])
    np.testing.assert_allclose(found, strain * corners + np.outer(height, (0, 0, 1)), atol=1e-15)
    stress_free = 0.5 * SHEET.youngs_modulus / 0.7 * SHEET.thickness * strain**2
    assert abs(energy) < 1e-9 * stress_free


def test_creases_turn_by_their_moments_and_rest_angles():
    fold = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=180.0)
    k, turn = 3.0, 1e-3
    options = {"fold_law": "linear", "crease_stiffness": k, "level": 1}
    folds = fd.Actuate([0], 180.0 - np.degrees(turn)), fd.CreaseMoment([0], -k * turn)
    for load, stored in zip(folds, (0.0, 0.5 * k * turn**2), strict=True):
        found, bent, energy = isostatic(fold, [load], **options)
        lifted = turn * np.maximum(fold.vertices[:, 0] - 1.0, 0.0)
        np.testing.assert_allclose(found[:, 2], lifted, atol=1e-9 * turn)
        np.testing.assert_allclose([bent, energy], [0.0, stored], atol=1e-9 * k * turn**2)


def test_large_turns_are_warned_of():
    case = fd.Case(both(level=2)[0], HELD, [fd.Force([TIP], (0.0, 0.0, 1.0))])
    small = fd.trace(case, "newton", load_factors=[1.0])["displacement"].values[-1, TIP, 2]
    with pytest.warns(ModelRangeWarning, match=r"panels turn by .* degrees at point 0"):
        fd.trace(case, "newton", load_factors=[0.2 / small])


@pytest.mark.matrix
@pytest.mark.parametrize(
    ("pattern", "thickness", "meshes"),
    [
        (PATTERN, 0.003, (8, 12)),
        (fd.patterns.kresling(sides=6, height=1.5, twist=30), 0.025, (12, 16)),
        (fd.patterns.miura(cells=(1, 1), dihedral=176), 0.01, (8, 12)),
    ],
    ids=["thin", "tower", "nearly flat"],
)
def test_errors_bound_the_difference_to_fine_shells(pattern, thickness, meshes):
    sheet, supports = replace(SHEET, thickness=thickness), [fd.Fix("zmin")]
    shells = [
        frequencies(
            fd.shell(pattern, sheet, divisions=n, mass="consistent", vertex_radius=thickness),
            supports,
        )
        for n in meshes
    ]
    limit = shells[1] + (shells[1] - shells[0]) / ((meshes[1] / meshes[0]) ** 2 - 1.0)
    for level in (3, 5):
        made = fd.superelements(pattern, sheet, level=level)
        modes = fd.modes(fd.Case(made, supports), 8)
        off = np.abs(modes["frequency"].values - limit)
        assert (off < modes["frequency_error"].values).all()
        assert (modes["frequency_error"] < 0.05 * modes["frequency"]).all()
        if level == 5:
            assert (off < 0.01 * limit).all()


@pytest.mark.matrix
def test_no_motion_has_a_negative_mass():
    """Turns of a hexagon, of hardly any mass, would get one in the limit of fine meshes."""
    angle = np.arange(6) * np.pi / 3.0
    hexagon = fd.Pattern(0.04 * np.column_stack([np.cos(angle), np.sin(angle)]), [range(6)])
    sheet = fd.Sheet(youngs_modulus=2e9, poissons_ratio=0.35, thickness=3e-4, density=1200.0)
    mass = fd.superelements(hexagon, sheet).body.sheet.mass
    assert np.linalg.eigvalsh(mass.toarray())[0] > -1e-15


@pytest.mark.matrix
def test_congruent_panels_are_condensed_once():
    sheet = fd.superelements(fd.patterns.miura(cells=(2, 2)), SHEET, level=1)
    assert len(sheet.whole.groups) == 1


MOVES_FAR = {
    "contact": {"contact": fd.Contact()},
    r"loads\[0\]: the force": {"loads": [fd.LineLoad([(0, 1)], (0.0, 0.0, 1.0))]},
    "StrainDamping": {"damping": fd.StrainDamping(1e-3)},
}


@pytest.mark.parametrize("named", MOVES_FAR)
def test_what_superelements_leave_out_is_refused(named):
    structure = fd.superelements(PATTERN, SHEET, level=1, divisions=4)
    with pytest.raises(InputError, match=named):
        fd.Case(structure, HELD, **MOVES_FAR[named])


@pytest.mark.parametrize(
    "analysis",
    [
        lambda c: fd.simulate(c, 0.1, method="newmark"),
        lambda c: fd.critical_step(c),
        lambda c: fd.modes(c, state="equilibrium"),
        lambda c: fd.fidelity(c),
        lambda c: fd.lyapunov_exponent(c, 1.0),
        lambda c: fd.trace(
            c.altered(loads=[fd.Force([TIP], (1.0, 0.0, 0.0))]), "newton", inertia_relief=True
        ),
    ],
)
def test_analyses_of_what_moves_far_are_refused(analysis):
    structure = fd.superelements(PATTERN, SHEET, level=1, divisions=4)
    with pytest.raises(InputError, match=r"superelements|linear"):
        analysis(fd.Case(structure, HELD))


@pytest.mark.parametrize(
    ("options", "named"),
    [
        ({"level": 6}, "level = 6"),
        ({"divisions": 6}, "divisions = 6.*multiple of 4"),
        ({"fold_law": "superlinear"}, "no slope at rest"),
        ({"mass": "centroid"}, "mass"),
        ({"vertex_radius": 0.4}, "vertex_radius = 0.4"),
        ({"rigid": [9]}, "panel 9"),
    ],
)
def test_wrong_options_are_named(options, named):
    with pytest.raises(InputError, match=named):
        fd.superelements(PATTERN, SHEET, **options)


def test_meshes_with_fewer_points_than_shapes_are_refused():
    structure = fd.superelements(PATTERN, replace(SHEET, thickness=0.05), divisions=4)
    with pytest.raises(InputError, match="divisions = 4: edges have 9 points"):
        fd.modes(fd.Case(structure, HELD))


def test_sheets_without_density_are_refused():
    with pytest.raises(InputError, match="density"):
        fd.superelements(PATTERN, replace(SHEET, density=None))


CASE = """
[pattern]
kind = "miura"
cells = [1, 1]
[sheet]
youngs_modulus = 1e9
poissons_ratio = 0.3
thickness = 0.01
density = 1000.0
[model]
kind = "superelements"
level = 2
[[supports]]
nodes = "xmin"
along = true
[analysis]
kind = "modes"
count = 3
"""


@pytest.mark.matrix
def test_a_case_file_gives_modes_that_can_be_run_again(tmp_path):
    path = tmp_path / "sheet.toml"
    path.write_text(CASE, encoding="utf-8")
    found = fd.read_case(path).run()
    fd.save(found, tmp_path / "modes.nc")
    again = fd.modes(fd.case_of(fd.load(tmp_path / "modes.nc")), 3)
    np.testing.assert_array_equal(again["frequency"], found["frequency"])
    np.testing.assert_array_equal(again["frequency_error"], found["frequency_error"])


@pytest.mark.matrix
def test_a_path_has_a_page(tmp_path, monkeypatch):
    path = tmp_path / "sheet.toml"
    warm = "[[loads]]\ntemperature = 0.1\nexpansion = 1e-5\n"
    text = CASE.replace('kind = "modes"\ncount = 3', f'kind = "statics"\n{warm}')
    path.write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    assert main(["run", str(path)]) == 0
    assert "panels" in (tmp_path / "sheet-results/report.html").read_text("utf-8")


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ("level = 2", 'scheme = "n4b5"', "model.scheme"),
        ("level = 2", "level = 9", "model.level"),
        ("count = 3", "count = 3\nsecant = 1.0", "analysis.secant"),
        ('kind = "superelements"\n', "", "model.level"),
    ],
)
def test_wrong_case_files_are_refused(tmp_path, old, new, named):
    path = tmp_path / "sheet.toml"
    path.write_text(CASE.replace(old, new), encoding="utf-8")
    with pytest.raises(InputError, match=named):
        fd.read_case(path)


def test_long_panels_are_warned_of():
    """Facets of an L-section, 400 x 50 mm; cut in four, frequencies agree with a fine shell."""

    def modes(pieces):
        x = np.array([[0.05, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.05]])
        step = 0.4 / pieces * np.eye(3)[1]
        points = np.concatenate([x + k * step for k in range(pieces + 1)])
        first = [3 * k + i for k in range(pieces) for i in range(2)]
        faces = [(i, i + 1, i + 4, i + 3) for i in first]
        welds = fd.Pattern(points, faces).creases.tolist()
        pattern = fd.Pattern(points, faces, welds=welds)
        steel = fd.Sheet(2e11, 0.3, 1e-3, density=7850.0)
        held = [fd.Fix("ymin", along=True)]
        return fd.modes(fd.Case(fd.superelements(pattern, steel), held), count=4)

    with pytest.warns(ModelRangeWarning, match="modes 3, 4 may be more than 5% off"):
        long = modes(1)
    short = modes(4)
    np.testing.assert_allclose(short.frequency, [39.19, 121.05, 170.5, 213.22], rtol=2e-3)
    off = np.abs(long.frequency.values - short.frequency.values)[:2]
    assert ((long.frequency_error + short.frequency_error).values[:2] > off).all()
    assert (short.frequency_error < 0.01 * short.frequency).all()


@pytest.mark.parametrize(("divisions", "count"), [(4, 100), (None, 156)])
def test_all_modes_of_one_panel(divisions, count):
    """The lowest of all modes, of full matrices, are those that Lanczos finds alone."""
    corners = np.array([[0.0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0], [0, 0.1, 0]])
    panel, sheet = fd.Pattern(corners, [[0, 1, 2, 3]]), fd.Sheet(2e9, 0.3, 1e-3, 1000.0)
    case = fd.Case(fd.superelements(panel, sheet, divisions=divisions), [fd.Fix("xmin")])
    few, every = fd.modes(case, 8), fd.modes(case, count)
    np.testing.assert_allclose(every.frequency[:8], few.frequency, rtol=1e-9)
    np.testing.assert_allclose(every.frequency_error[:8], few.frequency_error, rtol=0.1)
    if divisions == 4:  # shapes outnumber the inner nodes of so coarse a mesh
        with pytest.raises(InputError, match=r"count = 156: the case has only 1\d\d modes, as"):
            fd.modes(case, 156)
