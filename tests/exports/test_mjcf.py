"""Models of MuJoCo: what is in them, and that MuJoCo finds the motions that we do."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import FoldynWarning, InputError

PULL = fd.Gravity((0.5, 1.0, -3.0))
FILM = fd.Sheet(2e8, 0.3, 3e-3, density=400.0)
STIFF = fd.Sheet(2e9, 0.3, 3e-3, density=400.0)


@pytest.fixture
def mujoco():
    return pytest.importorskip("mujoco")


def rigid(pattern, supports=(), loads=(), sheet=FILM, **parts):
    """A case of panels that hardly deform, with exact inertia, and creases of 0.3 N m/rad per m."""
    options = {"crease_rest": parts.pop("crease_rest", None)}
    structure = fd.discretize(
        pattern, sheet, scheme="n5b8", mass="inertia_exact", rigid="all", fold_law="linear",
        crease_stiffness=0.3, **options,
    )  # fmt: skip
    return fd.Case(structure, list(supports), list(loads), **parts)


def miura(cells=(1, 1), **options):
    return fd.patterns.miura(cells=cells, a=0.4, b=0.4, panel_angle=60, dihedral=90, **options)


def hanging(first, second, length=0.3):
    """Two plates below the y axis, at angles (degrees) to the vertical."""
    steps = [length * np.array([np.sin(t), 0.0, -np.cos(t)]) for t in np.radians([first, second])]
    line = np.concatenate([[np.zeros(3)], np.cumsum(steps, axis=0)])
    points = np.repeat(line, 2, axis=0) + np.tile([[0, 0, 0], [0, 0.2, 0]], (3, 1))
    return fd.Pattern(points, [(0, 2, 3, 1), (2, 4, 5, 3)])


def touching():
    """Two squares with one corner in common."""
    points = [[0, 0, 0], [3, 0, 0], [3, 3, 0], [0, 3, 0], [6, 3, 0], [6, 6, 0], [3, 6, 0]]
    return fd.Pattern(0.1 * np.array(points), [(0, 1, 2, 3), (2, 4, 5, 6)])


def junction():
    """Three panels at one line."""
    angles = np.radians([0.0, 100.0, 230.0])
    points = [[0, 0, 0], [1, 0, 0], *([x, np.cos(a), np.sin(a)] for a in angles for x in (0, 1))]
    return fd.Pattern(0.3 * np.array(points), [(0, 1, 3, 2), (0, 1, 5, 4), (1, 0, 6, 7)])


def exported(case, tmp_path):
    """The model of a case as XML."""
    (path,) = fd.export(case, tmp_path / "model.xml")
    return ET.parse(path).getroot()


def joints(root):
    return {own.get("name"): own for own in root.iter("joint") if own.get("pos")}


def numbers(text):
    return np.array(text.split(), float)


# ------------------------------------------------------------------ the file
def test_each_crease_is_one_joint_and_a_loop_is_closed_by_a_weld(tmp_path):
    case = rigid(miura())
    root = exported(case, tmp_path)
    assert sorted(filter(None, joints(root))) == [f"crease_{k}" for k in range(4)]
    assert [own.get("type") for own in root.findall("worldbody/body/joint")] == ["free"]
    (weld,) = root.iter("weld")
    bodies = {own.get("name"): own.find("inertial") for own in root.iter("body")}
    copy, panel = bodies.pop(weld.get("body2")), bodies[weld.get("body1")]
    assert copy.attrib == panel.attrib
    mass = {name: float(own.get("mass")) for name, own in bodies.items()}
    assert sorted(bodies) == [f"panel_{k}" for k in range(4)]
    assert mass.pop(weld.get("body1")) == pytest.approx(0.5 * min(mass.values()), rel=1e-12)
    assert sum(mass.values()) == pytest.approx(0.75 * case.total_mass, rel=1e-12)


def test_inertia_is_that_of_a_uniform_plate(tmp_path):
    """A rectangle of 0.3 m by 0.2 m, 3 mm thick, and a point mass at its corner."""
    points = [(0, 0, 0), (0.3, 0, 0), (0.3, 0.2, 0), (0, 0.2, 0)]
    case = rigid(fd.Pattern(points, [(0, 1, 2, 3)]))
    (own,) = exported(case, tmp_path).iter("inertial")
    a, b, t, mass = 0.3, 0.2, 3e-3, 0.06 * 1.2
    true = np.array([b * b + t * t, a * a + t * t, a * a + b * b, 0, 0, 0]) * mass / 12.0
    np.testing.assert_allclose(numbers(own.get("fullinertia")), true, rtol=1e-12, atol=1e-17)
    np.testing.assert_allclose(numbers(own.get("pos")), [0.15, 0.1, 0.0], atol=1e-16)
    weighed = case.altered(masses=[fd.PointMass([2], mass)])
    (own,) = exported(weighed, tmp_path).iter("inertial")
    np.testing.assert_allclose(numbers(own.get("pos")), [0.225, 0.15, 0.0], atol=1e-16)
    assert float(own.get("mass")) == pytest.approx(2.0 * mass)


@pytest.mark.parametrize(
    ("nodes", "kinds", "pins"),
    [
        ([0, 1, 3], [], 0),  # a panel
        ([0, 1], ["hinge"], 0),  # its edge
        ([0], ["ball"], 0),
        ([], ["free"], 0),
        ([0, 1, 2], ["hinge"], 1),  # edges of two panels
        ([1, 4, 7], ["hinge"], 1),  # the crease between four panels
        ([4], ["ball"], 0),  # the vertex of all
    ],
)
def test_what_is_held_becomes_the_joint_of_the_root(nodes, kinds, pins, tmp_path):
    root = exported(rigid(miura(), [fd.Fix(nodes)] if nodes else []), tmp_path)
    bodies = root.findall("worldbody/body")
    found = [own.find("joint").get("type") for own in bodies if own.find("joint").get("type")]
    assert found == kinds
    assert len(list(root.iter("connect"))) == pins
    assert bool(root.findall("worldbody/geom")) == (not kinds)
    assert len(list(root.iter("geom"))) == 5  # with that of the defaults


def test_attributes_of_creases(tmp_path):
    """Angles are turns from rest; the stop and the latch, springs that are slack before them."""
    pattern = hanging(40, 20)
    stops = [fd.Stop([0], 150, 5.0), fd.Latch([0], 210, 7.0)]
    dampers = [fd.CreaseDamping(0.02), fd.StrainDamping(0.5)]
    case = rigid(pattern, [fd.Fix([0, 1]), *stops], damping=dampers, crease_rest=[190.0])
    with pytest.warns(FoldynWarning, match="leaves out the hold of Latch; add what you need"):
        root = exported(case, tmp_path)
    own, rest = joints(root)["crease_0"], np.radians(190.0)
    assert float(own.get("stiffness")) == pytest.approx(0.3 * 0.2)
    assert float(own.get("damping")) == pytest.approx(0.2 * (0.02 + 0.5 * 0.3))
    assert float(own.get("ref")) == pytest.approx(pattern.dihedrals[0] - rest)
    np.testing.assert_allclose(numbers(own.get("range")), np.radians([150.0, 210.0]) - rest)
    assert own.get("limited") == "false"
    stop, latch = root.findall("tendon/fixed")
    bands = [numbers(one.get("springlength")) for one in (stop, latch)]
    np.testing.assert_allclose(bands[0], [np.radians(-40.0), 2.0 * np.pi])
    np.testing.assert_allclose(bands[1], [-2.0 * np.pi, np.radians(20.0)])
    np.testing.assert_allclose([float(one.get("stiffness")) for one in (stop, latch)], [1.0, 1.4])


def test_a_crease_between_held_panels_has_no_joint(tmp_path):
    case = rigid(
        hanging(40, 20), [fd.Fix([0, 1, 2, 3, 4]), fd.Stop([0], 150, 5.0)],
        [fd.Actuate([0], angle=120)],
    )  # fmt: skip
    root = exported(case, tmp_path)
    assert not any(list(root.iter(tag)) for tag in ("body", "joint", "fixed", "position"))


def test_compliant_panels_leave_the_stiffness_of_the_crease_alone(tmp_path):
    """In `plate`, a hinge is crease and panels in series."""
    case = rigid(hanging(40, 20))
    series = fd.discretize(hanging(40, 20), FILM, preset="plate", crease_stiffness=0.3)
    assert series.fold_stiffness[0] < 0.99 * 0.06
    root = exported(case.altered(structure=series), tmp_path)
    assert float(joints(root)["crease_0"].get("stiffness")) == pytest.approx(0.06)


def test_panels_are_drawn_with_both_sides(tmp_path):
    """Front and back are half the thickness off, and face outward."""
    root, pattern = exported(rigid(miura()), tmp_path), miura()
    for normal, face, mesh in zip(
        pattern.face_normals, pattern.faces, root.iter("mesh"), strict=True
    ):
        sides = numbers(mesh.get("vertex")).reshape(2, -1, 3)
        off = (sides - pattern.vertices[face[0]]) @ normal
        np.testing.assert_allclose(off, [[1.5e-3], [-1.5e-3]] * np.ones_like(off), atol=1e-15)
        a, b, c = sides.reshape(-1, 3)[numbers(mesh.get("face")).astype(int).reshape(-1, 3).T]
        double = np.cross(b - a, c - a) @ normal
        np.testing.assert_allclose(np.abs(double).sum(), 4.0 * pattern.face_areas[0])
        assert (double.reshape(2, -1) * [[1.0], [-1.0]] > 0.0).all()


# ------------------------------------------------------------------ what is refused
@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"supports": [fd.Fix([4, 5]), fd.Fix([0], "z")]}, "supports: hold node 0 along some axes"),
        ({"supports": [fd.Impose([0], "z", 1e-3)]}, r"supports\[0\]: .* no joint for this Impose"),
        ({"supports": [fd.Fix([0], direction=(1, 0, 1))]}, r"supports\[0\]: .* for this Fix"),
        ({"supports": [fd.Spring(1.0, nodes=[0])]}, r"supports\[0\]: .* for this Spring; leave it"),
        ({"supports": [fd.Link([0, 1])]}, r"supports\[0\]: MuJoCo has no joint for this Link"),
    ],
)
def test_what_moves_otherwise_is_refused(change, message, tmp_path):
    with pytest.raises(InputError, match=message):
        exported(rigid(hanging(40, 20)).altered(**change), tmp_path)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"clamped": [(0, 1)]}, "clamped: hold three corners of these panels"),
        ({"fold_law": "superlinear"}, 'fold_law = .*take "linear" or "enhanced"'),
        ({"sheet": fd.Sheet(1e6, 0.25, 0.01)}, "density is missing"),
    ],
)
def test_structures_that_are_refused(options, message, tmp_path):
    structure = fd.discretize(hanging(40, 20), **{"sheet": FILM, **options})
    with pytest.raises(InputError, match=message):
        exported(fd.Case(structure, [fd.Fix([0, 1])]), tmp_path)


def test_superelements_are_refused(tmp_path):
    linear = fd.superelements(hanging(40, 20), FILM)
    with pytest.raises(InputError, match="structure: must have panels that can turn far"):
        exported(fd.Case(linear, [fd.Fix([0, 1])]), tmp_path)


def test_what_is_left_out_is_named(tmp_path):
    loads = [fd.Force([4], (0, 0, 1.0)), fd.Gravity("-z", fd.Ramp(1.0))]
    supports = [fd.Fix([0, 1]), fd.Dashpot(1.0, nodes=[4])]
    case = rigid(hanging(40, 20), supports, loads, damping=fd.Rayleigh(0.1), contact=fd.Contact())
    names = "Dashpot, Force, Rayleigh, contact, the history of Gravity;"
    with pytest.warns(FoldynWarning, match=f"leaves out {names}"):
        root = exported(case, tmp_path)
    np.testing.assert_allclose(numbers(root.find("option").get("gravity")), [0, 0, -9.80665])


# ------------------------------------------------------------------ what MuJoCo finds
def loaded(mujoco, case, tmp_path):
    (path,) = fd.export(case, tmp_path / "model.xml")
    model = mujoco.MjModel.from_xml_path(str(path))
    model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    model.opt.integrator = int(mujoco.mjtIntegrator.mjINT_RK4)
    return model, mujoco.MjData(model)


def displaced(model, data, case):
    """Displacements (m) of the corners of each panel, with the body of that panel."""
    points, found = case.structure.nodes, []
    for panel, face in enumerate(case.structure.pattern.faces):
        mesh = model.mesh(f"panel_{panel}").id
        body = model.geom_bodyid[np.flatnonzero(model.geom_dataid == mesh)[0]]
        turn, x = data.xmat[body].reshape(3, 3), points[list(face)]
        found.append(data.xpos[body] + x @ turn.T - x)
    return np.concatenate(found)


def moves(mujoco, model, data, case, times, control=None):
    """Displacements (samples, corners, 3) and energies (samples, 2), J, potential and kinetic."""
    found, energies = [], []
    for time in times:
        while data.time < time - 0.5 * model.opt.timestep:
            if control is not None:
                data.ctrl[:] = control(data.time + 0.5 * model.opt.timestep)
            mujoco.mj_step(model, data)
        mujoco.mj_forward(model, data)
        found.append(displaced(model, data, case))
        energies.append(data.energy.copy())
    return np.array(found), np.array(energies)


def ours(case, duration):
    motion = fd.simulate(case, duration, method="rk4", interval=0.02)
    corners = np.concatenate(case.structure.pattern.faces)
    return motion, motion.displacement.values[:, corners]


def apart(mujoco, case, tmp_path, duration=0.3, control=None):
    """Largest difference of corners in MuJoCo from ours, relative to the largest displacement."""
    motion, true = ours(case, duration)
    model, data = loaded(mujoco, case, tmp_path)
    model.opt.timestep = min(2e-4, model.opt.timestep)
    found, _ = moves(mujoco, model, data, case, motion.time.values, control)
    return np.abs(found - true).max() / np.abs(true).max()


def softening(mujoco, model, data, angles):
    """Derivative of accelerations, times -1, by the angles of joints."""
    step, columns = 1e-5, []
    for axis in np.eye(len(angles)):
        pair = []
        for sign in (1.0, -1.0):
            data.qpos[:] = angles + sign * step * axis
            mujoco.mj_forward(model, data)
            pair.append(data.qacc.copy())
        columns.append((pair[1] - pair[0]) / (2.0 * step))
    return np.transpose(columns)


def test_small_vibrations_of_a_double_pendulum_of_plates(mujoco, tmp_path):
    """Frequencies in closed form, with absolute angles as coordinates; 1e-6 of them is found."""
    case = rigid(hanging(0, 0), [fd.Fix([0, 1])], [fd.Gravity((0, 0, -9.81))])
    model, data = loaded(mujoco, case, tmp_path)
    slope = softening(mujoco, model, data, np.zeros(2))
    a, t, k = 0.3, 3e-3, 0.06
    m = 400.0 * t * a * 0.2
    own = m * (a * a / 3.0 + t * t / 12.0)
    mass = np.array([[own + m * a * a, m * a * a / 2.0], [m * a * a / 2.0, own]])
    weight = 9.81 * m * a * np.diag([1.5, 0.5])
    true = np.linalg.eigvals(np.linalg.solve(mass, weight + k * np.array([[1, -1], [-1, 1]])))
    np.testing.assert_allclose(np.sort(np.linalg.eigvals(slope).real), np.sort(true), rtol=1e-6)


@pytest.mark.parametrize("supports", [[], [fd.Stop([0], 199, 1e3)]])
def test_the_step_resolves_the_fastest_vibration(supports, mujoco, tmp_path):
    """Of a stiff crease, or of a soft one beyond its stop."""
    case = rigid(hanging(40, 20), [fd.Fix([0, 1]), *supports])
    if not supports:
        stiff = fd.discretize(hanging(40, 20), FILM, crease_stiffness=1e3)
        case = case.altered(structure=stiff)
    model, data = loaded(mujoco, case, tmp_path)
    turned = np.array([0.0, -np.radians(2.0)])  # beyond the stop
    fastest = np.linalg.eigvals(softening(mujoco, model, data, turned)).real.max() ** 0.5
    assert 0.02 < model.opt.timestep * fastest < 0.1
    step = exported(rigid(hanging(40, 20)), tmp_path).find("option").get("timestep")
    assert float(step) == 1e-3


def test_a_large_swing_of_a_double_pendulum(mujoco, tmp_path):
    """With exact inertia; what is left is the stretching of our panels, 4e-6."""
    film = fd.Sheet(2e10, 0.3, 1e-3, density=1000.0)
    case = rigid(hanging(60, 20), [fd.Fix([0, 1])], [fd.Gravity((0, 0, -9.81))], film)
    motion, true = ours(case, 1.0)
    model, data = loaded(mujoco, case, tmp_path)
    model.opt.timestep = 1e-3
    found, energy = moves(mujoco, model, data, case, motion.time.values)
    assert np.abs(found - true).max() < 2e-4 * np.abs(true).max()
    assert np.ptp(energy.sum(axis=1)) < 1e-6 * np.ptp(energy[:, 1])
    np.testing.assert_allclose(energy[:, 1], motion.kinetic.values, atol=2e-4 * energy[:, 1].max())


CASES = {
    "cell": lambda: rigid(miura(), [fd.Fix([0, 1])], [PULL]),
    "cell on a corner": lambda: rigid(miura(), [fd.Fix([0])], [PULL]),
    "weights": lambda: rigid(miura(), [fd.Fix([0, 1])], [PULL], masses=[fd.PointMass([8, 2], 0.3)]),
    "damped": lambda: rigid(miura(), [fd.Fix([0, 1])], [PULL], damping=fd.CreaseDamping(0.02)),
    "prestressed": lambda: rigid(
        miura(), [fd.Fix([0, 1])], sheet=STIFF, crease_rest=[100, 250, 80, 270]
    ),
    "sheet": lambda: rigid(miura((2, 2)), [fd.Fix([0, 2, 4])], [PULL]),
    "touching": lambda: rigid(touching(), [fd.Fix([0, 3])], [PULL]),
    "junction": lambda: rigid(junction(), [fd.Fix([4, 5])], [PULL]),
    "junction, held": lambda: rigid(junction(), [fd.Fix([4, 5, 0])], [PULL]),
}


@pytest.mark.parametrize("name", CASES)
def test_motions_are_ours(name, mujoco, tmp_path):
    """Loops stay closed, too: each panel is compared. At worst 3.3e-4."""
    assert apart(mujoco, CASES[name](), tmp_path) < 5e-4


def test_the_folding_motion_of_a_cell_has_our_frequency(mujoco, tmp_path):
    """Small vibrations with a loop; also by the step and the method of the file."""
    case = rigid(miura(), [fd.Fix([0, 1, 3])])
    true = fd.modes(case, 1, check_model=False).frequency.item()
    (path,) = fd.export(case, tmp_path / "model.xml")
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    free = np.linalg.svd(data.efc_J.reshape(data.nefc, model.nv))[2][-1]
    data.qvel[:] = 1e-3 * free
    turned = []
    for _ in range(int(10.2 / true / model.opt.timestep)):
        mujoco.mj_step(model, data)
        turned.append(float((data.qpos - model.qpos0) @ free))
    turned = np.array(turned)
    up = np.flatnonzero((turned[:-1] < 0.0) & (turned[1:] >= 0.0))
    crossed = up + turned[up] / (turned[up] - turned[up + 1])
    found = (len(up) - 1) / (crossed[-1] - crossed[0]) / model.opt.timestep
    assert found == pytest.approx(true, rel=1e-3)


def test_stops_are_ours(mujoco, tmp_path):
    """A swing bounces between two stops of different stiffness."""
    stops = [fd.Stop([0], 241, 50.0), fd.Stop([0], 200, 20.0)]
    case = rigid(hanging(60, 0), [fd.Fix([0, 1])], [fd.Gravity((0, 0, -9.81))])
    free = ours(case, 1.0)[1]
    case = case.altered(supports=[fd.Fix([0, 1]), *stops])
    assert np.abs(ours(case, 1.0)[1] - free).max() > 0.1 * np.abs(free).max()
    assert apart(mujoco, case, tmp_path, 1.0) < 1e-3


def test_controls_fold_creases_as_ours(mujoco, tmp_path):
    """A control is the change of the rest angle; 0 leaves it."""
    pattern = miura()
    target = 0.8 * np.degrees(pattern.dihedrals) + 36.0
    load = fd.Actuate("all", angle=target.tolist(), history=fd.Ramp(0.2, smooth=True))
    case = rigid(pattern, [fd.Fix([0, 1])], [load])
    ((change, history),) = case.actuation_terms
    root = exported(case, tmp_path)
    servos = root.findall("actuator/position")
    order = [int(own.get("joint").removeprefix("crease_")) for own in servos]
    assert not any(own.get("stiffness") for own in joints(root).values())
    assert apart(mujoco, case, tmp_path, control=lambda t: change[order] * history(t)) < 5e-4
    np.testing.assert_allclose(numbers(root.find("keyframe/key").get("ctrl")), change[order])
    ranges = [numbers(own.get("ctrlrange")) for own in servos]
    np.testing.assert_allclose(ranges, np.abs(change[order])[:, None] * [[-1.0, 1.0]])


def test_a_welded_panel_is_one_body(mujoco, tmp_path):
    points = [[0, 0, 0], [1, 0, 0], [1.2, 0.7, 0], [0.5, 1.2, 0], [-0.2, 0.7, 0], [1.6, 0.2, 0.4]]
    pattern = fd.Pattern(
        0.3 * np.array(points), [(0, 1, 2, 4), (4, 2, 3), (1, 5, 2)], welds=[(2, 4)]
    )
    structure = fd.discretize(pattern, FILM, crease_stiffness=0.3)
    model, data = loaded(mujoco, fd.Case(structure, [fd.Fix([0, 4])], [PULL]), tmp_path)
    assert model.nbody == 3 and model.nv == 2 and model.ngeom == 3
    area = pattern.face_areas[:2].sum()
    assert model.body_mass[1] == pytest.approx(400.0 * 3e-3 * area, rel=1e-9)
    mujoco.mj_step(model, data)


def test_shells_give_the_same_bodies(mujoco, tmp_path):
    bars = loaded(mujoco, CASES["cell"](), tmp_path)[0]
    shell = fd.shell(miura(), FILM, divisions=3, crease_stiffness=0.3, fold_law="linear")
    case = fd.Case(shell, [fd.Fix([0, 1], along=True)], [PULL])
    mesh = loaded(mujoco, case, tmp_path)[0]
    for name in ("body_mass", "body_ipos", "jnt_axis", "jnt_pos", "jnt_stiffness", "dof_armature"):
        np.testing.assert_allclose(getattr(mesh, name), getattr(bars, name), atol=1e-12)


def test_the_page_folds_its_sheet(mujoco, tmp_path, monkeypatch):
    """All folds of a family turn alike, as between rigid panels, and in their directions."""
    monkeypatch.chdir(tmp_path)
    page = (Path(__file__).resolve().parents[2] / "docs/exports.md").read_text("utf-8")
    names = {}
    for code in re.findall(r"^```python\n(.*?)^```$", page.partition("## MuJoCo")[2], re.M | re.S):
        exec(compile(code, "exports.md", "exec"), names)
    data, model = names["data"], names["model"]
    found = [data.joint(model.actuator(k).name).qpos[0] for k in range(model.nu)]
    np.testing.assert_allclose(found, np.sign(data.ctrl) * found[0], rtol=1e-4)
    assert 0.35 < found[0] < 0.7  # of 40 degrees, against the other folds
