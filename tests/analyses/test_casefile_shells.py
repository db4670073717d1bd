"""Case files of shells: one file for both models, and what means nothing to one of them."""

from __future__ import annotations

import numpy as np
import pytest
from casefile_checks import check, edited

import foldyn as fd
from case_texts import FOLD_TEXT
from foldyn.analyses import read_case
from foldyn.analyses.motion import MASSLESS_METHODS
from foldyn.cases.models import MODELS
from foldyn.dynamics import METHODS
from foldyn.errors import InputError

# case study 1 of the paper, loaded slowly
FOLD = (
    FOLD_TEXT
    + """\
[model]
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
)
SHELL = ('kind = "bars_and_hinges"', 'kind = "shell"\ndivisions = 2')
STATICS = 'kind = "statics"\nsteps = 1'
MOTION = (STATICS, 'kind = "dynamics"\nduration = 1.0')
MODES = [("[[loads]]\nnodes = [0, 1]\nforce = [-1e-3, 0, 0]\n", ""), (STATICS, 'kind = "modes"')]


def drive(method: str, more: str = "") -> list[tuple[str, str]]:
    """Edits that make it a frequency response."""
    analysis = f'kind = "frf"\nmethod = "{method}"\nfrequencies = [0.1, 0.2]\n{more}'
    return [("[[loads]]", "[[drive]]"), (STATICS, analysis)]


def test_one_file_gives_both_models_and_they_bend_alike(read):
    moved = {}
    for kind in MODELS:
        case_file = read(edited(FOLD, [('kind = "bars_and_hinges"', f'kind = "{kind}"')]))
        path = fd.trace(case_file.case(), **case_file.analysis.arguments)
        moved[kind] = path.displacement.sel(node=case_file.output.nodes, axis="x").values[-1]
        assert case_file.model == kind
    # design, section 5: a shell 0.0348 m
    np.testing.assert_allclose(moved["bars_and_hinges"], -0.0348, rtol=0.01)
    np.testing.assert_allclose(moved["shell"], -0.0348, rtol=0.01)
    np.testing.assert_allclose(moved["bars_and_hinges"], moved["shell"], rtol=0.12)


def test_the_keys_of_a_shell(read):
    model = """kind = "shell"
divisions = 3
fold_law = { kind = "enhanced", theta1 = 30, theta2 = 330 }
crease_stiffness = 0.02
crease_rest = 290
mass = ["lumped", "consistent"]"""
    case_file = read(edited(FOLD, [('kind = "bars_and_hinges"', model), MOTION]))
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


def test_defaults_of_a_shell(read):
    case_file = read(edited(FOLD, [('kind = "bars_and_hinges"', 'kind = "shell"'), MOTION]))
    assert case_file.case().structure.options == fd.shells.ShellOptions()
    assert case_file.masses == ["lumped"]
    assert case_file.analysis.arguments["method"] == "auto"
    plain = read(edited(FOLD, [MOTION]))
    assert plain.masses == ["consistent"] and plain.analysis.arguments["method"] == "rk4"


def test_integrators_of_shells_are_those_of_the_registry(read):
    massless = tuple(name for name, method in METHODS.items() if method.massless)
    assert massless == MASSLESS_METHODS
    for method in (*MASSLESS_METHODS, "auto"):
        text = edited(FOLD, [SHELL, (STATICS, f'{MOTION[1]}\nmethod = "{method}"')])
        assert read(text).analysis.arguments["method"] == method


def test_integrators_of_simulated_responses(read):
    named = drive("impulse", 'integrator = "newmark"')
    assert read(edited(FOLD, [SHELL, *named])).analysis.arguments["integrator"] == "newmark"
    left_out = read(edited(FOLD, [SHELL, *drive("impulse")])).analysis.arguments
    assert "integrator" not in left_out  # the response chooses an implicit one


WRONG = {
    "no such model": (
        [(SHELL[0], 'kind = "shells"')],
        "model.kind = \"shells\": did you mean 'shell'? choose one of bars_and_hinges, shell",
    ),
    "keys of bars and hinges": (
        [(SHELL[0], 'kind = "shell"\nbend_law = "linear"\nscheme = "n4b5"')],
        'model.scheme: only for model.kind = "bars_and_hinges"; a shell has no scheme, bend_law: '
        "leave them out",
    ),
    "a key of shells": (
        [(SHELL[0], "divisions = 4")],
        'model.divisions: only for model.kind = "shell"; bars and hinges have no divisions: leave '
        "it out",
    ),
    "a mass rule of bars and hinges": (
        [(SHELL[0], 'kind = "shell"\nmass = "circumcenter"')],
        'model.mass = "circumcenter": only for model.kind = "bars_and_hinges"; choose one of '
        "lumped, consistent",
    ),
    "one of a list of mass rules": (
        [(SHELL[0], 'kind = "shell"\nmass = ["lumped", "panel"]'), MOTION],
        'model.mass[1] = "panel": only for model.kind = "bars_and_hinges"',
    ),
    "the mass of a shell": (
        [(SHELL[0], 'mass = "lumped"')],
        'model.mass = "lumped": only for model.kind = "shell"; choose one of equi_inertial',
    ),
    "no divisions": (
        [(SHELL[0], 'kind = "shell"\ndivisions = 0')],
        "model.divisions = 0: must be at least 1",
    ),
    "an explicit method": (
        [SHELL, (STATICS, f'{MOTION[1]}\nmethod = "rk4"')],
        'analysis.method = "rk4": needs mass everywhere, and the rotations of a shell have none; '
        "choose one of auto, newmark, generalized_alpha, energy_momentum, or leave it out",
    ),
    "an explicit integrator": (
        [SHELL, *drive("impulse", 'integrator = "rk4"')],
        'analysis.integrator = "rk4": needs mass everywhere',
    ),
    "internal amplitudes": (
        [SHELL, MODES[0], (STATICS, 'kind = "modes"\ninternal = 3')],
        "analysis.internal = 3: is for the panels of bars and hinges; leave it out",
    ),
    "a secant": (
        [SHELL, MODES[0], (STATICS, 'kind = "modes"\nsecant = 1')],
        "analysis.secant = 1.0: is for superlinear bends, and a shell has none; leave it out",
    ),
    "a support on the mesh": (
        [SHELL, ("nodes = [4, 5]", "nodes = [4, 6]")],
        "supports[0].nodes: 6 is no vertex of the pattern, which has 0 to 5; a case file names "
        "nodes of a shell by vertex, whatever its divisions",
    ),
    "a load on the mesh": (
        [SHELL, ("nodes = [0, 1]\nforce", "nodes = [8]\nforce")],
        "loads[0].nodes: 8 is no vertex",
    ),
    "a drive on the mesh": (
        [SHELL, *drive("direct"), ("nodes = [0, 1]\nforce", "nodes = [8]\nforce")],
        "drive[0].nodes: 8 is no vertex",
    ),
    "an output on the mesh": (
        [SHELL, ("[output]\nnodes = [0, 1]", "[output]\nnodes = [6]")],
        "output.nodes: 6 is no vertex",
    ),
    "an end on the mesh": (
        [SHELL, ("steps = 1", 'until = { node = 6, axis = "x", displacement = -0.01 }')],
        "analysis.until.node: 6 is no vertex",
    ),
}


@pytest.mark.parametrize(("edits", "message"), WRONG.values(), ids=WRONG)
def test_wrong_files(read, edits, message):
    check(read, edited(FOLD, edits), message)


@pytest.fixture
def filed(tmp_path):
    """Function that writes a text with edits and returns its path."""

    def write(*edits: tuple[str, str], text: str = FOLD):
        path = tmp_path / "case2.toml"
        path.write_text(edited(text, list(edits)))
        return path

    return write


def test_a_file_of_bars_and_hinges_as_a_shell(filed):
    model = """scheme = "n4b5"
mass = ["panel", "consistent"]
bend_law = "linear"
fold_law = "linear"
crease_rest = 290"""
    motion = f'{MOTION[1]}\nmethod = "rk4"\ndt = 1e-5\nforce = true'
    path = filed(('kind = "bars_and_hinges"', model), (STATICS, motion))
    case_file = read_case(path, model="shell", divisions=3)
    assert (case_file.model, case_file.masses) == ("shell", ["lumped"])
    options = case_file.case().structure.options
    assert (options.divisions, options.fold_law, options.crease_rest) == (3, "linear", 290)
    arguments = case_file.analysis.arguments
    assert (arguments["method"], arguments["dt"], arguments["force"]) == ("auto", None, False)
    assert case_file.case().supports == read_case(path).case().supports
    assert case_file.case().loads == read_case(path).case().loads


def test_an_implicit_method_stays_with_its_step(filed):
    path = filed((STATICS, f'{MOTION[1]}\nmethod = "newmark"\ndt = 0.01'))
    arguments = read_case(path, model="shell").analysis.arguments
    assert (arguments["method"], arguments["dt"]) == ("newmark", 0.01)


def test_responses_and_modes_as_those_of_a_shell(filed):
    simulated = filed(*drive("impulse", 'integrator = "rk4"\ndt = 1e-4\npulse = 0.01'))
    arguments = read_case(simulated, model="shell").analysis.arguments
    assert arguments["pulse"] == 0.01
    assert not {"integrator", "dt"} & set(arguments)
    judged = filed(MODES[0], (STATICS, 'kind = "modes"\nsecant = 1\ninternal = 2\ncount = 3'))
    given = read_case(judged, model="shell").analysis.arguments
    assert (given["secant"], given["internal"]) == (None, 0)
    assert read_case(judged, model="shell").analysis.arguments["count"] == 3


def test_a_file_of_a_shell_as_bars_and_hinges(filed):
    path = filed((SHELL[0], 'kind = "shell"\ndivisions = 2\nmass = "lumped"\ncrease_rest = 290'))
    case_file = read_case(path, model="bars_and_hinges")
    assert (case_file.model, case_file.masses) == ("bars_and_hinges", ["consistent"])
    assert case_file.case().structure.options.crease_rest == 290
    assert read_case(path, divisions=4).case().structure.options.divisions == 4
    assert read_case(path, model="shell").case().structure.options.divisions == 2


@pytest.mark.parametrize(
    ("arguments", "edits", "message"),
    [
        ({"model": "plate"}, [], 'model = "plate": choose one of bars_and_hinges, shell'),
        ({"divisions": 4}, [], 'model.divisions: only for model.kind = "shell"'),
        ({"model": "shell", "divisions": 0}, [], "model.divisions = 0: must be at least 1"),
        # the file is checked as it is, too
        ({"model": "shell"}, [(SHELL[0], 'schema = "n5b8"')], "model.schema: unknown key"),
        ({"model": "shell"}, [(SHELL[0], 'bend_law = "soft"')], 'model.bend_law = "soft"'),
        (
            {"model": "shell"},
            [('\n[model]\nkind = "bars_and_hinges"', ""), ("[pattern]", "model = 3\n[pattern]")],
            "model = 3: must be a table",
        ),
    ],
)
def test_wrong_models_for_a_file(filed, arguments, edits, message):
    path = filed(*edits)
    check(lambda _: read_case(path, **arguments), "", message)


def test_a_state_of_another_mesh_is_refused(filed, tmp_path):
    coarse = read_case(filed(SHELL))
    bent = fd.trace(coarse.case(), load_factors=[1.0])
    fd.save(bent, tmp_path / "coarse.nc")
    path = filed(SHELL, MOTION, text=FOLD + '[initial]\nfile = "coarse.nc"\n')

    state = read_case(path).initial()
    assert state is not None
    np.testing.assert_array_equal(state.displacement, bent.displacement.values[-1])
    with pytest.raises(InputError, match="a result of the same pattern and model"):
        read_case(path, divisions=3).initial()
