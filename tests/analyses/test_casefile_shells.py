"""Case files of shells: one file for both models, and what means nothing to one of them."""

from __future__ import annotations

import numpy as np
import pytest
from casefile_checks import check

import foldyn as fd
from case_texts import FOLD_TEXT, changed, rows
from foldyn.analyses import read_case
from foldyn.dynamics import METHODS
from foldyn.errors import InputError

# case study 1 of the paper, loaded slowly
FOLD = f"""{FOLD_TEXT}[model]
kind = "bars_and_hinges"
[[supports]]
nodes = [4, 5]
[[supports]]
nodes = "zmin and x<0.5"
axes = "z"
[[loads]]
nodes = [0, 1]
force = [-1e-3, 0, 0]
[analysis]
kind = "statics"
steps = 1
[output]
nodes = [0, 1]
"""
SHELL = 'model.kind = "shell"; model.divisions = 2'
MOTION = 'analysis = { kind = "dynamics", duration = 1.0 }'
IMPULSE = (
    "loads =; drive = [{ nodes = [0, 1], force = [-1e-3, 0, 0] }]; analysis = "
    '{ kind = "frf", method = "impulse", frequencies = [0.1, 0.2] }'
)


@pytest.fixture
def filed(tmp_path):
    """Function that writes the text with edits and returns its path."""

    def write(edits: str):
        path = tmp_path / "case2.toml"
        path.write_text(changed(FOLD, edits))
        return path

    return write


def test_one_file_gives_both_models_and_they_bend_alike(filed):
    moved = {}
    for kind in ("bars_and_hinges", "shell"):
        case_file = read_case(filed(f'model.kind = "{kind}"'))
        path = fd.trace(case_file.case(), **case_file.analysis.arguments)
        moved[kind] = path.displacement.sel(node=case_file.output.nodes, axis="x").values[-1]
        assert case_file.model == kind
        np.testing.assert_allclose(moved[kind], -0.0348, rtol=0.01)  # design, section 5
    np.testing.assert_allclose(moved["bars_and_hinges"], moved["shell"], rtol=0.12)


def test_the_keys_of_a_shell(filed):
    model = """model = { kind = "shell", divisions = 3, crease_stiffness = 0.02, crease_rest = 290,
    mass = ["lumped", "consistent"], fold_law = { kind = "enhanced", theta1 = 30, theta2 = 330 } }
    """
    case_file = read_case(filed(f"{' '.join(model.split())}; {MOTION}"))
    assert case_file.masses == ["lumped", "consistent"]
    shell = case_file.case().structure
    assert isinstance(shell, fd.Shell)
    assert (shell.options.divisions, shell.fold_law.theta1) == (3, 30)
    assert shell.fold_stiffness == pytest.approx(0.02)  # of a crease of 1 m
    assert np.degrees(shell.fold_rest) == pytest.approx(290)
    masses = [case_file.case(mass).structure.mass for mass in case_file.masses]
    assert [matrix.nnz == len(shell.nodes) for matrix in masses] == [True, False]
    with pytest.raises(InputError, match="choose one of lumped, consistent"):
        case_file.case("panel")


def test_defaults_of_a_shell(filed):
    case_file = read_case(filed(f'model.kind = "shell"; {MOTION}'))
    assert case_file.case().structure.options == fd.ShellOptions()
    assert case_file.masses == ["lumped"]
    assert case_file.analysis.arguments["method"] == "auto"
    plain = read_case(filed(MOTION))
    assert plain.masses == ["condensed"]


def test_shells_move_by_all_methods(filed):
    for method in (*METHODS, "auto"):
        path = filed(f'{SHELL}; {MOTION}; analysis.method = "{method}"')
        assert read_case(path).analysis.arguments["method"] == method


@pytest.mark.parametrize("rigid", ['"all"', "[0]"])
def test_a_shell_of_rigid_panels_moves_by_explicit_methods_too(filed, rigid):
    few = 'model.divisions = 2; analysis.duration = 0.05; analysis.method = "rk4"'
    made = read_case(filed(f"{SHELL}; {MOTION}; {few}; model.rigid = {rigid}"))
    assert made.run().attrs["method"] == "rk4"


def test_integrators_of_simulated_responses(filed):
    named = read_case(filed(f'{SHELL}; {IMPULSE}; analysis.integrator = "newmark"'))
    assert named.analysis.arguments["integrator"] == "newmark"
    left_out = read_case(filed(f"{SHELL}; {IMPULSE}")).analysis.arguments
    assert "integrator" not in left_out  # the response chooses an implicit one


# edits, and how the message begins
WRONG = """
model.kind = "shells": did you mean 'shell'? choose one of bars_and_hinges, shell
model.kind = "shell"; model.bend_law = "linear"; model.scheme = "n4b5" | model.scheme: only for
    model.kind = "bars_and_hinges"; a shell has no scheme, bend_law: leave them out
model.kind =; model.divisions = 4 | model.divisions: only for model.kind = "shell"; bars and
    hinges have no divisions: leave it out
model.kind = "shell"; model.mass = "circumcenter" | model.mass = "circumcenter": only for
    model.kind = "bars_and_hinges"; choose one of lumped, consistent
model.kind = "shell"; model.mass = ["lumped", "panel"]; analysis.steps =; analysis.kind =
    "dynamics"; analysis.duration = 1.0 | model.mass[1] = "panel": only for model.kind =
    "bars_and_hinges"
model.kind =; model.mass = "lumped" | model.mass = "lumped": only for model.kind = "shell"; choose
    one of equi_inertial
model.kind = "shell"; model.divisions = 0 | model.divisions = 0: must be at least 1
loads =; model.kind = "shell"; analysis.steps =; analysis.kind = "modes"; analysis.secant = 1 |
    analysis.secant = 1.0: is for superlinear bends, which a shell cannot have; leave it out
model.kind = "shell"; supports[0].nodes = [4, 6] | supports[0].nodes: 6 is no vertex of the
    pattern, which has 0 to 5; a case file names nodes of a shell, or of
    superelements, by vertex
model.kind = "shell"; loads[0].nodes = [8] | loads[0].nodes: 8 is no vertex
loads =; model.kind = "shell"; drive = [{ nodes = [8], force = [-0.001, 0, 0] }]; analysis = {
    kind = "frf", method = "direct", frequencies = [0.1, 0.2] } | drive[0].nodes: 8 is no vertex
model.kind = "shell"; output.nodes = [6] | output.nodes: 6 is no vertex
model.kind = "shell"; analysis.steps =; analysis.until = { node = 6, axis = "x", displacement =
    -0.01 } | analysis.until.node: 6 is no vertex
"""


@pytest.mark.parametrize(("edits", "message"), rows(WRONG))
def test_wrong_files(read, edits, message):
    check(read, changed(FOLD, edits), message)


def test_a_file_of_bars_and_hinges_as_a_shell(filed):
    model = """model = { scheme = "n4b5", mass = ["panel", "consistent"], bend_law = "linear",
    fold_law = "linear", crease_rest = 290 }"""
    motion = f'{MOTION[:-2]}, method = "rk4", dt = 1e-5, force = true }}'
    path = filed(f"{' '.join(model.split())}; {motion}")
    case_file = read_case(path, model="shell", divisions=3)
    assert (case_file.model, case_file.masses) == ("shell", ["lumped"])
    options = case_file.case().structure.options
    assert (options.divisions, options.fold_law, options.crease_rest) == (3, "linear", 290)
    arguments = case_file.analysis.arguments
    assert (arguments["method"], arguments["dt"], arguments["force"]) == ("auto", None, False)
    assert case_file.case().supports == read_case(path).case().supports
    assert case_file.case().loads == read_case(path).case().loads


def test_an_implicit_method_stays_with_its_step(filed):
    path = filed(f'{MOTION}; analysis.method = "newmark"; analysis.dt = 0.01')
    arguments = read_case(path, model="shell").analysis.arguments
    assert (arguments["method"], arguments["dt"]) == ("newmark", 0.01)


def test_responses_and_modes_as_those_of_a_shell(filed):
    options = 'analysis.integrator = "rk4"; analysis.dt = 1e-4; analysis.pulse = 0.01'
    arguments = read_case(filed(f"{IMPULSE}; {options}"), model="shell").analysis.arguments
    assert arguments["pulse"] == 0.01
    assert not {"integrator", "dt"} & set(arguments)
    judged = filed('loads =; analysis = { kind = "modes", secant = 1, count = 3 }')
    given = read_case(judged, model="shell").analysis.arguments
    assert (given["secant"], given["count"]) == (None, 3)


def test_a_file_of_a_shell_as_bars_and_hinges(filed):
    path = filed(f'{SHELL}; model.mass = "lumped"; model.crease_rest = 290')
    case_file = read_case(path, model="bars_and_hinges")
    assert (case_file.model, case_file.masses) == ("bars_and_hinges", ["condensed"])
    assert case_file.case().structure.options.crease_rest == 290
    assert read_case(path, divisions=4).case().structure.options.divisions == 4
    assert read_case(path, model="shell").case().structure.options.divisions == 2


@pytest.mark.parametrize(
    ("arguments", "edits", "message"),
    [
        ({"model": "plate"}, "", 'model = "plate": choose one of bars_and_hinges, shell'),
        ({"divisions": 4}, "", 'model.divisions: only for model.kind = "shell"'),
        ({"model": "shell", "divisions": 0}, "", "model.divisions = 0: must be at least 1"),
        # the file is checked as it is, too
        ({"model": "shell"}, 'model = { schema = "n5b8" }', "model.schema: unknown key"),
        ({"model": "shell"}, 'model = { bend_law = "soft" }', 'model.bend_law = "soft"'),
        ({"model": "shell"}, "model = 3", "model = 3: must be a table"),
    ],
)
def test_wrong_models_for_a_file(filed, arguments, edits, message):
    check(lambda _: read_case(filed(edits), **arguments), "", message)


@pytest.mark.matrix
def test_a_state_of_another_mesh_is_refused(filed, tmp_path):
    bent = fd.trace(read_case(filed(SHELL)).case(), load_factors=[1.0])
    fd.save(bent, tmp_path / "coarse.nc")
    path = filed(f'{SHELL}; {MOTION}; initial.file = "coarse.nc"')
    state = read_case(path).initial()
    assert state is not None
    np.testing.assert_array_equal(state.displacement, bent.displacement.values[-1])
    with pytest.raises(InputError, match="a result of the same pattern and model"):
        read_case(path, divisions=3).initial()
