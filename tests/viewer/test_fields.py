"""Colors of a page: energies of panels add up to those of the result, also where creases fold."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import foldyn as fd
from foldyn.structures import hinge_angles
from foldyn.viewer.states import fields
from named_models import named

SHEET = fd.Sheet(1e9, 0.3, 1e-3, density=700.0)
SUPPORTS = [fd.Fix([0, 1, 2], axes="xyz")]


def structure(**options):
    return fd.discretize(
        fd.patterns.miura((2, 2), 0.1, b=0.1, panel_angle=60, dihedral=90), SHEET, **named(options)
    )


@pytest.mark.parametrize(
    "options",
    [
        {"scheme": "n4b5"},
        {"scheme": "n5b8"},
        {"scheme": "n5b8", "bend_law": "plate_superlinear", "calibration": "plate"},
    ],
    ids=["n4b5", "n5b8", "bends with onsets of their own"],
)
def test_energies_of_panels_add_up(options):
    s = structure(**options)
    u = 1e-3 * np.random.default_rng(3).normal(size=(3, len(s.nodes), 3))
    moments = xr.Dataset(coords={"time": [0.0, 1.0, 2.0]})
    density = fields(fd.Case(s, SUPPORTS, []), moments, u)["energy"].values
    wanted = [s.energy(x) for x in u]
    assert np.allclose(density @ s.pattern.face_areas, wanted, rtol=1e-10)


def test_energy_lies_where_the_fold_is():
    s = structure()
    u = np.zeros((1, *s.nodes.shape))
    u[0, s.pattern.faces[0][0]] = (0.0, 0.0, 1e-3)  # a corner of the sheet
    density = fields(fd.Case(s, [], []), xr.Dataset(coords={"time": [0.0]}), u)["energy"].values[0]
    beside = set(s.pattern.crease_faces[(s.pattern.crease_faces == 0).any(axis=1)].ravel().tolist())
    assert set(np.flatnonzero(density > 1e-12 * density.max()).tolist()) <= beside
    assert density.argmax() == 0


@pytest.mark.parametrize("constant", [(), (0,)], ids=["growing", "constant"])
def test_rest_angles_follow_what_folds_them_on_a_path(constant):
    s = structure(fold_law="linear", bend_law="linear")
    loads = [fd.Actuate("all", fraction=0.4), fd.Force([s.pattern.faces[-1][2]], (0.0, 0.0, 0.02))]
    path = fd.trace(fd.Case(s, SUPPORTS, loads), load_factors=[0.5, 1.0], constant=constant)
    check(s, path)


def test_rest_angles_follow_what_folds_them_in_a_motion():
    s = structure(fold_law="linear", bend_law="linear")
    case = fd.Case(s, SUPPORTS, [fd.Actuate("all", fraction=0.6, history=fd.Ramp(0.01))])
    check(s, fd.simulate(case, 0.01, method="rk4", interval=2e-3))


MODELS = {
    "plate": lambda pattern, sheet, **options: fd.discretize(pattern, sheet, **named(options)),
    "n5b8e": lambda pattern, sheet, **o: fd.discretize(pattern, sheet, preset="n5b8e", **o),
    "n5b8e with bars": lambda pattern, sheet, **o: fd.discretize(
        pattern, sheet, preset="n5b8e", membrane="bars", **o
    ),
    "herkal": lambda pattern, sheet, **o: fd.discretize(
        pattern, sheet, preset="herkal", bend_law="linear", **o
    ),
    "shell": lambda pattern, sheet, **o: fd.shell(pattern, sheet, divisions=4, **o),
}


@pytest.mark.parametrize("model", MODELS)
def test_all_models_have_energies_that_add_up_also_where_loads_fold(model):
    """Unknowns without mass stand where actuation has put them."""
    pattern = fd.patterns.miura((1, 1), 0.1, b=0.08, panel_angle=60, dihedral=90)
    s = MODELS[model](pattern, SHEET, crease_stiffness=0.3)
    loads = [fd.Actuate([0, 2], angle=140.0), fd.Force([8], (0.0, 0.01, 0.02))]
    path = fd.trace(fd.Case(s, [fd.Fix(pattern.faces[0])], loads), load_factors=[0.4, 1.0])
    check(s, path)


@pytest.mark.parametrize("clamped", [(), [(0, 1)]], ids=["free edges", "clamped"])
@pytest.mark.parametrize("model", MODELS)
def test_a_crease_bears_the_moment_of_its_flap_and_turns_by_it_alone(model, clamped):
    """A flap of length a with a force F at its end: F a, and F a over the stiffness of the crease.

    The dihedral of the facets turns further, by what the panels bend.
    """
    a, width, force, stiffness = 0.12, 0.07, 0.01, 0.9
    corners = [(x, y, 0.0) for x in (-a, 0.0, a) for y in (0.0, width)]
    pattern = fd.Pattern(corners, [(0, 2, 3, 1), (2, 4, 5, 3)], {(2, 3): "V"})
    s = MODELS[model](
        pattern, fd.Sheet(3e9, 0.2, 8e-4), crease_stiffness=stiffness / width, clamped=clamped
    )
    supports = [fd.Fix([0, 1, 2, 3])]
    path = fd.trace(fd.Case(s, supports, [fd.TotalForce((0, 0, force), nodes=[4, 5])]), steps=1)
    found = fields(fd.case_of(path), path, path["displacement"].values)
    assert found["fold_moment"].values[-1, 0] == pytest.approx(-force * a, rel=4e-3)
    turn = np.degrees(force * a / stiffness)
    assert found["turn"].values[-1, 0] == pytest.approx(-turn, rel=4e-3)
    if model != "herkal":  # whose creases are as stiff as they are with their panels
        dihedral = hinge_angles(s.nodes + path["displacement"].values[-1], s.folds)
        assert abs(np.degrees(dihedral[0] - np.pi)) > 1.02 * turn


@pytest.mark.parametrize("model", ["plate", "n5b8e"])
def test_turns_that_displacements_do_not_tell_are_left_out(model):
    """A damper beside a crease whose panels give way bears a part of the moment."""
    s = MODELS[model](
        fd.patterns.miura((1, 1), 0.1, b=0.1, panel_angle=60, dihedral=90), SHEET, fold_law="linear"
    )
    supports = [fd.Fix(s.pattern.faces[0])]
    damped = fd.Case(s, supports, [], fd.CreaseDamping(1e-4))
    still = np.zeros((1, *s.nodes.shape))
    path, motion = xr.Dataset(coords={"load_factor": [0.0]}), xr.Dataset(coords={"time": [0.0]})
    assert not {"turn", "fold_moment", "energy"} & set(fields(damped, motion, still))
    assert {"turn", "fold_moment", "energy"} <= set(fields(damped, path, still))


@pytest.mark.matrix
@pytest.mark.parametrize("model", MODELS)
def test_warm_panels_store_what_they_may_not_do(model):
    pattern = fd.patterns.miura((1, 1), 0.1, b=0.08, panel_angle=60, dihedral=90)
    s = MODELS[model](pattern, SHEET, fold_law="linear")
    loads = [
        fd.Temperature(2.0, expansion=1e-6, panels=[0, 3]),
        fd.Temperature(-1.0, expansion=3e-6, curvature=2e-3, panels=[1, 3], history=fd.Ramp(0.01)),
    ]
    case = fd.Case(s, [fd.Fix(pattern.faces[0])], loads)
    check(s, fd.trace(case, load_factors=[0.5, 1.0], constant=[0]))
    check(s, fd.simulate(case, 1e-3, method="newmark", dt=1e-4, interval=5e-4))


def test_creases_of_rigid_shells_have_all_of_their_energy():
    pattern = fd.patterns.miura((1, 1), 0.1, b=0.08, panel_angle=60, dihedral=90)
    s = fd.shell(pattern, SHEET, divisions=2, rigid="all", fold_law="linear")
    case = fd.Case(s, [fd.Fix(pattern.faces[0])], [fd.Force([8], (0.0, 0.0, 1e-3))])
    check(s, fd.trace(case, load_factors=[0.5, 1.0]))


def check(s, result):
    """Compare with the energies that the solver stored."""
    found = fields(fd.case_of(result), result, result["displacement"].values)
    stored = sum(result[name].values for name in s.energy_groups)
    total = found["energy"].values @ s.pattern.face_areas
    assert stored.max() > 0.0
    assert np.allclose(total, stored, rtol=1e-6, atol=1e-9 * stored.max())


def test_a_motion_that_has_exploded_has_the_fields_that_need_no_balance():
    s = structure(preset="n5b8e")
    u = 3.0 * np.random.default_rng(5).normal(size=(1, len(s.nodes), 3))
    found = fields(fd.Case(s, SUPPORTS, []), xr.Dataset(coords={"time": [0.0]}), u)
    assert list(found) == ["bar_strain"]
