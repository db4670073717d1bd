"""Paths in which supports and planes are released where something is reached."""

import numpy as np
import pytest

import foldyn as fd
from foldyn.cli.main import main
from foldyn.errors import ComputationError, InputError
from foldyn.structures.mesh import hinge_angles
from foldyn.sweeps.run_sweep import names_of

PANEL = fd.Pattern([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [(0, 1, 2, 3)])
PLATE = fd.discretize(PANEL, fd.Sheet(1e7, 0.3, 0.01, 100.0), preset="plate")
FLAP = fd.discretize(
    fd.patterns.simple_fold(dihedral=60), fd.Sheet(1e6, 0.25, 0.01, 1.0), preset="plate"
)
HINGED = [fd.Fix([4, 5]), fd.Fix([0, 1], "z")]
TIP = [2, 3]
PULL = [fd.Force(TIP, (0.0, 0.0, 0.05))]
SIDEWAYS = fd.Fix([0, 1, 2, 3], "xy")
KEPT, LET_GO = 30.0, 50.0  # N/m in all
LOAD = 8.0  # N


def balance(path, case):
    """Largest error of the energy balance (J) at any point, and the largest energy."""
    names = [*case.energy_groups, "dissipated"]
    total = sum(path[name].values for name in names) - path.work.values
    return np.abs(total - total[0]).max(), max(path[name].values.max() for name in names)


def angles(path):
    x = FLAP.nodes + path.displacement.values
    return np.degrees([hinge_angles(one, FLAP.folds)[0] for one in x])


def lifted(*until):
    """A panel lifted at its corners against springs, some of which let go."""
    corners = [0, 1, 2, 3]
    springs = [
        fd.Spring(k / 4, nodes=corners, direction="z", until=end)
        for k, end in ((KEPT, None), *((LET_GO / len(until), end) for end in until))
    ]
    return fd.Case(PLATE, [SIDEWAYS, *springs], [fd.Force(corners, (0.0, 0.0, LOAD / 4))])


@pytest.mark.parametrize(
    "given",
    [
        {"load_factors": np.linspace(0.0, 1.0, 11)},
        {"steps": 10},
        {"method": "arc_length", "load_factors": (0.0, 1.0), "first_step": 0.1},
        {"method": "mgdcm", "steps": 12, "first_step": 0.1},
    ],
    ids=["factors", "steps", "arc_length", "mgdcm"],
)
def test_springs_let_go_at_a_height(given):
    """Equilibria with all springs, then without those that let go, and the energy of the jump."""
    height = 0.0524
    case = lifted({"node": 2, "axis": "z", "displacement": height})
    path = fd.trace(case, **given)
    factor, z = path.load_factor.values, path.displacement.sel(axis="z").values[:, 2]
    k = int(np.flatnonzero(np.diff(factor) == 0.0)[0])  # the point before the release
    both, one = LOAD * factor / (KEPT + LET_GO), LOAD * factor / KEPT
    assert both[k] >= height > both[k - 1] and k > 3
    assert z[: k + 1] == pytest.approx(both[: k + 1], rel=1e-7, abs=1e-12)
    assert z[k + 1 :] == pytest.approx(one[k + 1 :], rel=1e-7) and len(z) >= k + 3
    lost = 0.5 * (KEPT + LET_GO) * both[k] ** 2 - 0.5 * KEPT * one[k] ** 2
    lost += LOAD * factor[k] * (one[k] - both[k])
    assert not path.dissipated.values[: k + 1].any()
    assert path.dissipated.values[k + 1 :] == pytest.approx(lost, rel=1e-6)
    off, scale = balance(path, case)
    assert off < 1e-6 * scale
    assert path.attrs["status"] == "complete"
    assert path.attrs["releases"] == f"supports[2] at the load factor {factor[k]:.6g}"
    if given.get("method") != "mgdcm":
        assert factor[-1] == pytest.approx(1.0)


def test_what_the_jump_reaches_is_released_too():
    """The first springs hold up to their height, the others do not hold the jump."""
    until = ({"node": 2, "axis": "z", "displacement": z} for z in (0.0524, 0.0601))
    path = fd.trace(lifted(*until), load_factors=np.linspace(0.0, 1.0, 11))
    factor, z = path.load_factor.values, path.displacement.sel(axis="z").values[:, 2]
    k = 6
    assert factor[k] == factor[k + 1] == factor[k + 2] == pytest.approx(0.6)
    stiff = KEPT + np.array([LET_GO, LET_GO / 2, 0.0])
    assert z[k : k + 3] == pytest.approx(LOAD * 0.6 / stiff, rel=1e-7)
    assert path.attrs["releases"].count("0.6") == 2 and path.sizes["step"] == 13


def test_a_fuse_breaks_at_a_tension_and_the_flap_goes_on_without():
    line = fd.Cable(
        [2, (0.0, 0.0, 3.0)],
        50.0,
        change=-0.02,
        history=fd.Ramp(1.0),
        until={"line": 0, "tension": 0.05},
    )
    case = fd.Case(FLAP, [*HINGED, line])
    path = fd.trace(case, load_factors=np.linspace(0.0, 1.0, 21))
    pull, factor = path.tension.values[:, 0], path.load_factor.values
    k = int(np.flatnonzero(np.diff(factor) == 0.0)[0])
    assert pull[k] >= 0.05 > pull[:k].max() and not pull[k + 1 :].any()
    assert np.abs(path.displacement.values[k + 1 :]).max() < 1e-9
    assert not path.strain_springs.values[k + 1 :].any()
    off, scale = balance(path, case)
    assert off < 2e-3 * scale  # work by trapezoids
    lost = path.dissipated.values[-1]
    stored = sum(path[name].values[k] for name in case.energy_groups)
    assert lost == pytest.approx(stored, rel=1e-6)


@pytest.mark.parametrize("method", ["newton", "displacement"])
def test_moved_supports_let_go_of_others(method):
    """An edge is pulled up; what holds the sheet goes at an angle. Then it is as if never there."""
    lift = fd.Impose(TIP, "z", 0.08)
    held = fd.Spring(2.0, nodes=[0, 1], direction="x", until={"crease": 0, "angle": 302.0})
    case = fd.Case(FLAP, [*HINGED, lift, held])
    path = fd.trace(case, method, load_factors=np.linspace(0.0, 1.0, 11))
    alone = fd.trace(fd.Case(FLAP, [*HINGED, lift]), method, load_factors=np.linspace(0.0, 1.0, 11))
    factor = path.load_factor.values
    k = int(np.flatnonzero(np.diff(factor) == 0.0)[0])
    turned = angles(path)
    rises = turned[k] >= 302.0 > turned[k - 1]
    assert rises and factor[-1] == 1.0
    goal = alone.displacement.values[-1]
    assert path.displacement.values[-1] == pytest.approx(goal, abs=1e-7 * np.abs(goal).max())
    assert path.reaction.values[-1] == pytest.approx(alone.reaction.values[-1], abs=1e-8)
    assert set(factor.round(9)) >= set(np.linspace(0.0, 1.0, 11).round(9))
    off, scale = balance(path, case)
    assert off < 0.02 * scale


def test_held_nodes_and_planes_are_released():
    """Their reactions and forces are zero afterwards; dimensions are those of the whole case."""
    floor = fd.Plane(
        (0, 0, -0.006), (0, 0, 1), until={"node": 0, "axis": "z", "displacement": 0.03}
    )
    contact = fd.Contact(panels=False, stiffness=10.0, planes=[floor])
    held = fd.Fix([1], "z", until={"node": 0, "axis": "z", "displacement": 0.02})
    springs = fd.Spring(5.0, nodes=[0, 1, 2, 3], direction="z")
    case = fd.Case(
        PLATE, [SIDEWAYS, springs, held], [fd.Force([0], (0.0, 0.0, 1.0))], contact=contact
    )
    path = fd.trace(case, load_factors=np.linspace(0.0, 1.0, 11))
    places = path.attrs["releases"].split("; ")
    assert [one.split()[0] for one in places] == ["supports[2]", "contact.planes[0]"]
    row = int(np.flatnonzero((path.support_node == 1) & (path.support_axis == "z"))[0])
    reaction, z = path.reaction.values[:, row], path.displacement.values[:, 0, 2]
    k = int(np.flatnonzero(z >= 0.02)[0])
    assert reaction[k] != 0.0 and not reaction[k + 1 :].any()
    assert path.sizes["plane"] == 1 and len(path.contact_force) == len(z)
    alone = fd.trace(
        fd.Case(PLATE, [SIDEWAYS, springs], case.loads), load_factors=[0.0, 0.5, 1.0]
    ).displacement.values[-1]
    assert path.displacement.values[-1] == pytest.approx(alone, abs=1e-7 * np.abs(alone).max())


def test_an_end_and_releases_together():
    until = {"node": 2, "axis": "z", "displacement": 0.0524}
    case = lifted(until)
    end = {"node": 2, "axis": "z", "displacement": 0.2}
    path = fd.trace(case, load_factors=np.linspace(0.0, 1.0, 11), until=end)
    z = path.displacement.sel(axis="z").values[:, 2]
    assert z[-1] >= 0.2 > z[-2] and path.attrs["status"] == "complete"
    with pytest.warns(fd.errors.FoldynWarning, match="has not reached"):
        path = fd.trace(case, load_factors=np.linspace(0.0, 1.0, 11), until={**end, "node": 0,
                        "displacement": 1.0})  # fmt: skip
    assert path.attrs["status"] == "until not reached"


def test_what_moves_freely_afterwards_ends_the_path():
    """All that was computed is kept."""
    until = {"node": 2, "axis": "z", "displacement": 0.049}
    case = fd.Case(
        PLATE, [SIDEWAYS, fd.Spring(10.0, nodes=[0, 1, 2, 3], direction="z", until=until)],
        [fd.Force([0, 1, 2, 3], (0.0, 0.0, 1.0))],
    )  # fmt: skip
    with pytest.raises(ComputationError, match=r"after the release of .* move freely") as caught:
        fd.trace(case, load_factors=np.linspace(0.0, 1.0, 11))
    partial = caught.value.partial
    assert partial.displacement.values[-1, 2, 2] >= 0.049 and partial.sizes["step"] == 6


def test_a_latch_stays_engaged_through_a_release():
    latch = fd.Latch([0], 304.0, stiffness=5.0)
    held = fd.Spring(0.5, nodes=[0, 1], direction="x", until={"crease": 0, "angle": 305.0})
    lift = fd.Impose(TIP, "z", 0.15)
    case = fd.Case(FLAP, [*HINGED, lift, held, latch])
    path = fd.trace(case, load_factors=np.linspace(0.0, 1.0, 11))
    k = int(np.flatnonzero(np.diff(path.load_factor.values) == 0.0)[0])
    engaged = fd.latched(path).values[:, 0]
    assert engaged[k] and engaged[k + 1 :].all() and not engaged[0]


# ---------------------------------------------------------------------- files and refusals
def test_case_files_and_stored_paths(tmp_path):
    text = """
        [pattern]
        kind = "simple_fold"
        dihedral = 60
        [sheet]
        youngs_modulus = 1e6
        poissons_ratio = 0.25
        thickness = 0.01
        density = 1.0
        [model]
        preset = "plate"
        [[supports]]
        nodes = [4, 5]
        [[supports]]
        nodes = [0, 1]
        axes = "z"
        [[supports]]
        nodes = [2, 3]
        stiffness = 5.0
        until = { node = 2, axis = "z", displacement = 0.002 }
        [[loads]]
        nodes = [2, 3]
        force = [0, 0, 0.05]
        [analysis]
        kind = "statics"
        steps = 10
        until = { crease = 0, angle = 301.0 }
    """
    file = tmp_path / "flap.toml"
    file.write_text(text)
    path = fd.read_case(file).run()
    assert path.attrs["releases"].startswith("supports[2] at the load factor 0.")
    turned = angles(path)
    assert turned[-1] >= 301.0 > turned[-2]
    fd.save(path, tmp_path / "path.nc")
    again = fd.case_of(fd.load(tmp_path / "path.nc"))
    assert again.supports[2].until == fd.read_case(file).case().supports[2].until
    file.write_text(text.replace("until = { node", "until = 0.5 # { node"))
    with pytest.raises(InputError, match=r"supports\[2\]\.until = 0\.5: a path has no time"):
        fd.read_case(file).run()


def test_refusals():
    case = lifted({"node": 2, "axis": "z", "displacement": 0.0524})
    with pytest.raises(InputError, match="duration: a path that takes time releases nothing"):
        fd.trace(case, load_factors=[0.0, 1.0], duration=1.0)
    path = fd.trace(case, steps=10)
    path["point"][3] = "bifurcation"
    with pytest.raises(InputError, match="has released parts"):
        fd.switch_branch(path)


# ---------------------------------------------------------------------- what a stranger tried
def test_what_the_start_reaches_is_released_there():
    case = lifted({"node": 2, "axis": "z", "displacement": 0.0524})
    up = fd.trace(case, load_factors=[0.0, 0.5, 1.0])
    down = fd.trace(case, load_factors=[0.4, 0.2], initial=fd.initial_state(up))
    assert down.displacement.values[:, 2, 2] == pytest.approx(
        LOAD * np.array([0.4, 0.2]) / KEPT, rel=1e-7
    )
    assert down.attrs["releases"] == "supports[2] at the load factor 0.4"


def test_a_broken_line_pulls_with_nothing():
    line = fd.Cable([2, (1.0, 1.0, -1.0)], 50.0, until={"line": 0, "tension": 0.5})
    lift = [fd.Force([0, 1, 2, 3], (0.0, 0.0, LOAD / 4))]
    case = fd.Case(
        PLATE, [SIDEWAYS, fd.Spring(KEPT / 4, nodes=[0, 1, 2, 3], direction="z"), line], lift
    )
    with pytest.warns(fd.errors.FoldynWarning, match="has not reached"):
        path = fd.trace(case, steps=10, until={"line": 0, "tension": 100.0})
    assert path.load_factor.values[-1] == 1.0 and path.attrs["releases"]


@pytest.mark.filterwarnings("ignore::foldyn.errors.FoldynWarning")
def test_a_path_past_a_limit_point_goes_on_as_it_went():
    """The spring lets go while the load falls: the tip sinks on."""
    flat = fd.discretize(
        fd.patterns.simple_fold(dihedral=160), fd.Sheet(1e6, 0.25, 0.01, 1.0), preset="plate",
        crease_stiffness=1e-3,
    )  # fmt: skip
    at = {"node": 2, "axis": "z", "displacement": -0.15}
    supports = [
        fd.Fix([4, 5]),
        fd.Fix([0, 1], "xz"),
        fd.Spring(2.0, nodes=TIP, direction="z", until=at),
    ]
    case = fd.Case(flat, supports, [fd.Force(TIP, (0.0, 0.0, -1.0))])
    path = fd.trace(case, method="arc_length", steps=22, first_step=0.2)
    z, factor = path.displacement.values[:, 2, 2], path.load_factor.values
    k = path.attrs["released_from"][0]
    assert factor[k] < factor.max() and (np.diff(z[k:]) < 0.0).all()


def test_a_path_whose_jump_finds_no_equilibrium_is_kept():
    stiff = fd.Spring(5e4, nodes=TIP, until={"node": 2, "axis": "z", "displacement": -0.01})
    case = fd.Case(FLAP, [*HINGED, stiff], [fd.Force(TIP, (0.0, 0.0, -2000.0))])
    with pytest.raises(ComputationError, match=r"after the release of supports\[2\]") as caught:
        fd.trace(case, steps=10)
    kept = caught.value.partial
    assert kept.displacement.values[-1, 2, 2] <= -0.01 and kept.attrs["status"] == "stopped"


def test_gradients_refuse_releases():
    def made(thickness):
        sheet = fd.discretize(
            fd.patterns.simple_fold(dihedral=60),
            fd.Sheet(1e6, 0.25, thickness, 1.0),
            preset="plate",
        )
        held = fd.Spring(5.0, nodes=TIP, until={"crease": 0, "angle": 300.3})
        return fd.Case(sheet, [*HINGED, held], PULL)

    with pytest.raises(InputError, match="a path with gradients releases nothing"):
        fd.sensitivity(
            made, {"thickness": 0.01}, measures=["displacement[2,z]"],
            analysis={"kind": "statics", "load_factors": [0.0, 0.5, 1.0]},
        )  # fmt: skip


PRESSED = """
    [pattern]
    kind = "simple_fold"
    dihedral = 60
    [sheet]
    youngs_modulus = 1e6
    poissons_ratio = 0.25
    thickness = 0.01
    density = 1.0
    [[supports]]
    nodes = [4, 5]
    [[supports]]
    nodes = [0, 1]
    axes = "z"
    [[loads]]
    nodes = [2, 3]
    force = [0, 0, 0.05]
    [contact]
    panels = false
    planes = [{ point = [0, 0, -5], normal = [0, 0, 1] }]
    [analysis]
    kind = "statics"
    steps = 2
"""


def test_pages_of_paths_with_planes_and_names_of_swept_nodes(tmp_path):
    """Energies of contact have no prefix; keys do not take the names of a result's dimensions."""
    file = tmp_path / "pressed.toml"
    file.write_text(PRESSED)
    assert main(["run", str(file), "--out", str(tmp_path / "out"), "--quiet"]) == 0
    assert "contact" in (tmp_path / "out/report.html").read_text("utf-8")
    assert names_of(["supports[2].until.node"], ()) == ["supports_2_until_node"]
    assert names_of(["supports[2].until.angle"], ()) == ["angle"]
