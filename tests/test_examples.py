"""Every example runs, draws its pictures, and gets its physics right; so do scripts of figures."""

from __future__ import annotations

import importlib.util
import re
import runpy
import sys
from pathlib import Path

import numpy as np
import pytest

import foldyn as fd
from foldyn.periodic.orbit import amplitudes_of
from pairwise import beyond

ROOT = Path(__file__).resolve().parents[1]
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
FIGURES = ("folding", "pattern", "press", "stack")
SCRIPTS = [ROOT / "examples" / "patterns" / "make.py"]
SCRIPTS += [ROOT / "docs" / f"{name}_figures.py" for name in FIGURES]


def air_deployment(found):
    """Air slows the sheet, by its mass as well, and takes the energy of its swing back."""
    times, back = [], []
    for motion in found["motions"].values():
        assert motion.attrs["energy_error"] < 1e-3
        x = found["structure"].nodes[:, 0] + motion.displacement.values[:, :, 0]
        length = np.ptp(x, axis=1)
        times.append(float(motion.time[np.flatnonzero(length > 0.8)[0]]))
        back.append(length[motion.time.values > 0.2].min())
    assert times[0] <= times[1] < times[2]
    assert max(back[1:]) - back[0] > 0.2
    assert min(back[1:]) > 0.7
    assert float(found["motions"]["air"].air[-1]) > 0.05


def air_fall(found):
    """Sheets fall with the velocity at which drag bears their weight."""
    for dihedral, speed in found["speeds"].items():
        np.testing.assert_allclose(speed[-1], found["by_hand"][dihedral], rtol=3e-3)
    np.testing.assert_allclose(found["speeds"][180][-1], found["by_hand"][180], rtol=1e-3)


def air_gust(found):
    """Swings decay as quadratic damping says: to a third in twenty turns."""
    swings, by_hand = found["size"][found["turns"]], np.array(found["by_hand"])
    assert swings[-1] < 0.4 * swings[0]
    np.testing.assert_allclose(swings, by_hand, rtol=0.02)
    assert found["motion"].attrs["energy_error"] < 1e-4


def bilayer(found):
    """Arms curl up alike, near the arc of the free curvature."""
    heights = found["path"].displacement.values[:, :, 2]
    x, y = found["structure"].pattern.vertices[:, :2].T
    tips = [heights[:, np.flatnonzero(reach > reach.max() - 1e-9)] for reach in (x, y)]
    np.testing.assert_allclose(tips[0].mean(axis=1), tips[1].mean(axis=1), rtol=1e-6, atol=1e-12)
    assert (np.diff(tips[0].mean(axis=1)) > 0.0).all()
    np.testing.assert_allclose(found["lift"], found["arc"], rtol=0.12)


def case_study_1(found):
    """Energy is kept, both ends of the edge move alike, and both models swing alike by 8 %."""
    highest, back = [], []
    for motion in found["motions"].values():
        assert motion.attrs["energy_error"] < 1e-4
        x = motion.displacement.sel(node=[0, 1], axis="x").values
        assert np.abs(x[:, 0] - x[:, 1]).max() < 1e-3 * np.abs(x).max()
        highest.append(np.abs(x).max())
        crossing = np.flatnonzero((x[1:, 0] > 0.0) & (x[:-1, 0] <= 0.0))[0]
        back.append(float(motion.time[crossing]))
    np.testing.assert_allclose(highest[0], highest[1], rtol=0.08)
    np.testing.assert_allclose(back[0], back[1], rtol=0.08)


def clamped(found):
    """Both models agree to 10 %, and without the clamp the sheet swings more slowly."""
    both = found["frequencies"]
    np.testing.assert_allclose(both["reduced"][:2], both["shell"][:2], rtol=0.1)
    hinged = fd.Case(fd.discretize(found["pattern"], found["sheet"]), [fd.Fix(found["root"])])
    assert fd.modes(hinged, 1).frequency[0] < 0.96 * both["reduced"][0]


def contact_tower(found):
    """It closes, does not pass itself, and rests in the second stable state."""
    for force, height in found["heights"].items():
        assert 0.0 < height.min() < 10.0
        assert abs(height[-1] - found["stable"][1]) < 1.0
        assert found["motions"][force].attrs["energy_error"] < 1e-4
    assert float(found["motions"][80.0].contact.max()) > 1e-3  # J: its panels have met


def crane(found):
    assert not found["crane"].wrong
    assert found["crane"].strain < 2e-3


def deployment(found):
    """The sheet is a Miura-ori in the end, moves as one on the way, and comes to rest."""
    case, motion = found["case"], found["motion"]
    assert found["error"] < 1e-4
    x, y, _ = np.ptp(case.structure.nodes[case.structure.pattern.creases], axis=1).T
    for time in (0.4, 0.6, 0.8):
        u = motion.displacement.sel(time=time, method="nearest").values
        half = 0.5 * np.abs(np.pi - case.structure.dihedrals(u)[0])
        ratio = np.tan(half[x <= y].mean()) / np.tan(half[x > y].mean())
        assert abs(ratio - np.cos(np.radians(60))) < 0.02, time
    still = motion.isel(time=-1)
    left = still.kinetic + still.strain_bars + still.strain_folds + still.strain_bends
    assert left < 1e-6 * motion.work.max()
    assert motion.attrs["energy_error"] < 1e-6


def design_frequencies(found):
    """The sheet has the frequencies that were asked for."""
    modes = fd.modes(found["build"](**found["best"]["parameters"]), count=3)["frequency"].values
    np.testing.assert_allclose(modes, list(found["WANTED"].values()), rtol=1e-6)


def design_kresling(found):
    """The tower snaps at 20 N on each corner, over a barrier of 0.8 J."""
    landscape = fd.landscape(found["path"])
    np.testing.assert_allclose(landscape.barrier(), 0.8, rtol=1e-3)
    limits = found["path"]["load_factor"].values[found["path"]["point"].values == "limit"]
    np.testing.assert_allclose(limits[0], 20.0, rtol=1e-3)


def design_miura(found):
    """All five searches end at the same design, which keeps its constraint."""
    best = found["best"]
    np.testing.assert_allclose(best["measures"]["frequency[1]"], 12.0, rtol=1e-4)
    np.testing.assert_allclose([end.objective for end in best["ends"]], 1.77653, rtol=1e-5)
    assert best["evaluations"] < 250


def fidelity(found):
    """Plates follow the shell to 0.6 of the plate frequency, the standard does not."""
    result = found["result"]
    assert result.models == ("own", "standard", "plate")  # one's own is "n5b8e"
    assert [mode.below for mode in result.table()] == [True] * 8 + [False] * 4
    edges, standard, plate = (result.table(model)[:8] for model in result.models)
    assert max(abs(mode.error) for mode in plate) < 0.10
    assert min(mode.mac for mode in plate) > 0.93
    assert max(abs(mode.error) for mode in edges) < 0.025
    assert min(mode.error for mode in standard) > 0.25
    assert max(abs(mode.mesh_error) for mode in plate) < 0.02
    own, harder, plate = result.result["deflection_error"].values
    np.testing.assert_allclose([own, plate], [0.06, 0.07], atol=0.02)
    assert harder < -0.6


def hardening_miura(found):
    """Mode 2 at twice mode 1 joins in: the second harmonic peaks there, the shift changes sign."""
    assert 70.0 < found["resonant"] < 90.0
    hardens = found["dihedrals"][np.array(found["shifts"]) > 0.0]
    assert hardens.tolist() == [50, 60, 70, 140, 150]
    first = [float(spine.frequency[0]) for spine in found["spines"]]
    np.testing.assert_allclose(first, found["modes"][:, 0], rtol=1e-5)
    parts = [np.abs(one.coefficient.values[-1]).max(axis=(1, 2)) for one in found["spines"]]
    second = np.array([part[2] / part[1] for part in parts])
    assert (np.diff(second[:3]) > 0.0).all() and (np.diff(second[3:]) < 0.0).all()
    # at small amplitudes the shift grows with their square
    small = fd.backbone(found["case"](110), amplitudes=(3e-6, 3e-4), harmonics=5)
    off = small.frequency.values / small.frequency.values[0] - 1.0
    factor = (off / small.amplitude.values**2)[-5:]
    np.testing.assert_allclose(factor, factor[-1], rtol=0.02)


def jumping_resonance(found):
    """Only the strongest force bends the curve over, and the swing grows less than the force."""
    curves = list(found["curves"].values())
    assert [int((one.bifurcation == "fold").sum()) for one in curves] == [0, 0, 2]
    swings = [float(one.amplitude.max()) for one in curves]
    assert 1.5 < swings[1] / swings[0] < 2.0
    assert 1.5 < swings[2] / swings[1] < 2.0
    spine = found["spine"]
    peak = curves[-1].isel(point=int(curves[-1].amplitude.values.argmax()))
    assert abs(float(peak.frequency / spine.frequency[0]) - 1.0) > 0.03
    size = amplitudes_of(spine.coefficient.values)
    there = np.interp(float(peak.amplitude), size, spine.frequency.values)
    assert float(peak.frequency) == pytest.approx(there, rel=2e-4)
    assert float(spine.frequency[-1]) > float(spine.frequency[0])


def kresling_chain(found):
    """The rarefaction is the faster one and leads at last; the end absorbs energy."""
    strain, motion = found["strain"], found["motion"]
    pressed, pulled = (
        fd.signals.pulse(motion.time, strain, sign=sign, share=0.85) for sign in (-1, 1)
    )
    assert pulled.speed > 1.1 * pressed.speed
    assert (pulled.arrival < pressed.arrival)[40:].mean() > 0.8
    assert motion.attrs["energy_error"] < 1e-3
    assert float(motion.dissipated[-1]) > 0.0


def kresling_chaos(found):
    """In one state, on to both without order, and through both in each cycle."""
    heights, exponents = found["heights"], found["exponents"]
    low, shut = 48.5, 29.0  # mm: the barrier, and the height of the second state
    assert heights[4.0].min() > low
    assert heights[7.0].min() < shut < low < heights[7.0].max()
    assert heights[8.0].min() < shut < low < heights[8.0].max()
    assert exponents[7.0] > 2.0  # 1/s
    # with a complex pair of multipliers disturbances fade as exp(-alpha t / 2)
    np.testing.assert_allclose([exponents[4.0], exponents[8.0]], -20.0, rtol=0.15)
    once = {force: z[::32] for force, z in heights.items()}  # a period
    assert np.ptp(once[4.0]) < 1e-3 and np.ptp(once[8.0]) < 1e-3
    assert np.ptp(once[7.0]) > 20.0


def miura_bands(found):
    """The full gap is there while folded and closes as the sheet unfolds; the path agrees."""
    width = np.array(found["top"]) - found["bottom"]
    assert (width[:8] > 3.0).all() and (width[8:] < 0.0).all()
    full = found["gaps"].isel(gap=found["gaps"]["direction"].values == "all")
    (at,) = np.flatnonzero(found["dihedrals"] == 60)
    assert full["below"].values.tolist() == [found["below"]]
    assert float(full["width"][0]) == pytest.approx(width[at], rel=0.02)


def miura_plate(found):
    """Ratios of rigid panels, opposite in bending; the sheet is stiff across its folded rows."""
    assert found["ratio"][:, 0] == pytest.approx(found["published"], rel=1e-3)
    assert found["bent"][:10, 0] == pytest.approx(-found["published"][:10], rel=2e-3)
    assert found["bending"][0, 1] > 50.0 * found["bending"][0, 0]
    assert found["bending"][-1, 1] < 0.2 * found["bending"][-1, 0]


def point_mass(found):
    """f = sqrt(k / (M + c m)) / 2 pi: one k and one c for all weights, peaks at the frequencies."""
    line = 1.0 / np.sqrt(found["slope"] * found["added"] + found["start"])
    np.testing.assert_allclose(found["first"], line, rtol=0.02)
    for first, response in zip(found["first"], found["responses"].values(), strict=False):
        size = np.abs(response.receptance.sel(node=13, axis="y").values)
        f = response.frequency.values
        assert abs(f[size.argmax()] - first) < 2.0 * (f[1] - f[0])


def pressure(found):
    """The work of the air is in folds and panels; the tube shortens and opens, in both models."""
    path, case = found["path"], found["case"]  # of the shell
    strain = sum(float(path[name][-1]) for name in case.energy_groups)
    assert abs(float(path.work[-1]) / strain - 1.0) < 0.01  # trapezoids over 12 steps
    for row, way in zip(found["rows"], (-1.0, 1.0), strict=True):
        reduced, shell = (line.get_ydata() for line in row.lines)
        assert (way * np.diff(reduced) > 0.0).all()
        assert (way * np.diff(shell) > 0.0).all()
        np.testing.assert_allclose(np.ptp(reduced), np.ptp(shell), rtol=0.1)


def shaken_miura(found):
    """At first it swings in proportion, and then less, at a higher frequency."""
    peaks = [one.isel(point=int(one.amplitude.values.argmax())) for one in found["curves"].values()]
    swing = np.array([float(one.amplitude) for one in peaks])
    frequency = np.array([float(one.frequency) for one in peaks])
    np.testing.assert_allclose(swing[1] / swing[0], 3.0, rtol=5e-3)
    assert 5.5 < swing[2] / swing[0] < 5.9
    linear = fd.modes(fd.Case(found["s"], found["held"]), count=4).frequency.values
    assert np.abs(frequency[0] / linear - 1.0).min() < 5e-3
    assert frequency[2] > 1.005 * frequency[0]
    assert all(bool(one.stable.all()) for one in found["curves"].values())


def snap_through(found):
    """Two stable states and the barrier between them; see tests of landscapes for the numbers."""
    assert [state.stable for state in found["landscape"].states] == [True, False, True]


def solar_panel(found):
    """The panel holds; more stress leaves less margin, and noise weighs on the rails as m a."""
    assert all(0.0 < least < 5.0 for least in found["least"].values())
    stress = found["noise"].von_mises_rms.max().item()
    assert 3e8 / (1.5 * 3.0 * stress) - 1.0 >= found["least"]["launch noise"] - 1e-9
    mass, g = found["panel"].mass.sum(), found["G"]
    held = found["lifted"].reaction.isel(step=-1)
    np.testing.assert_allclose(held[held.support_axis == "z"].sum(), 20 * g * mass, rtol=1e-6)
    assert found["noise"].total_reaction_rms.sel(axis="z") > 3.0 * mass * g


def sweep(found):
    """Softer creases lower all frequencies; modulus over density, not one of them, decides."""
    grid, design = found["grid"], found["design"]
    assert grid.attrs["failed"] == design.attrs["failed"] == 0
    assert (grid["frequencies"].isel(mode=0, mass=0).diff("length_scale_ratio") < 0.0).all()
    points = design["frequency_1"].values
    scaled = points / np.sqrt(design["youngs_modulus"] / design["density"]).values
    assert np.std(scaled) / np.mean(scaled) < np.std(points) / np.mean(points)


def winch_and_latch(found):
    """Folded by the winch, held by latches, open again; its work is what is lost."""
    motion, size, held = found["motion"], found["size"], found["held"]
    assert motion.attrs["energy_error"] < 1e-3
    assert size.min() < 0.7 * size[0]
    assert size[215] < 0.9 * size[0]  # after 2.15 s the cable is slack, and latches hold
    assert float(motion.tension[215, 0]) == 0.0
    assert held[215] > 5
    assert held[225:].max() == 0
    assert size[-1] == pytest.approx(size[0], rel=1e-3)
    assert float(motion.work[-1]) == pytest.approx(float(motion.dissipated[-1]), rel=2e-3)


def solar_array(found):
    """All creases latch; without forces from outside, momenta stay zero, and the hub turns."""
    motion, held, turn = found["motion"], found["held"], found["turn"]
    assert motion.attrs["energy_error"] < 1e-6
    assert int(held[-1]) == 24
    flight = fd.attitude(motion)
    assert np.abs(flight.angular_momentum).max() < 1e-9
    assert np.abs(flight.momentum).max() < 1e-9
    assert float(turn.max()) > 45.0
    assert float(motion.work[-1]) < -3.0  # the motor brakes
    x = motion.displacement + motion.rest_position
    assert np.ptp(x[-1, :40, 0].values) > 3.42  # of 3.5 m, turned by 8 degrees


def thick_panel(found):
    """Hinges go where trigonometry says; closed, the stack is as high as its boards together."""
    assert found["error"] < 1e-8
    closed = [0.0, 0.0, found["boards"] * found["thickness"]]
    np.testing.assert_allclose(found["stack"], closed, atol=1e-9)


CHECKS = (
    air_deployment, air_fall, air_gust, bilayer, case_study_1, clamped, contact_tower, crane,
    deployment, design_frequencies, design_kresling, design_miura, fidelity, hardening_miura,
    jumping_resonance, kresling_chain, kresling_chaos, miura_bands, miura_plate, point_mass,
    pressure, shaken_miura, snap_through, solar_array, solar_panel, sweep, thick_panel,
    winch_and_latch,
)  # fmt: skip


LONG = (
    air_deployment, contact_tower, design_miura, jumping_resonance, kresling_chaos, hardening_miura,
    shaken_miura, solar_array, solar_panel, sweep, winch_and_latch,
)  # fmt: skip
SHORT = [check for check in CHECKS if check not in LONG]


def fewer(sweep):
    """That sweep, in this process, with three values of a range and few samples."""

    def swept(case, vary, **how):
        few = {k: re.sub(r":7\b", ":3", v) if isinstance(v, str) else v for k, v in vary.items()}
        samples = {"samples": 16} if "samples" in how else {}
        return sweep(case, few, **how | samples, processes=1)

    return swept


@pytest.mark.filterwarnings("ignore::foldyn.errors.CrossingWarning")
@pytest.mark.filterwarnings("ignore:.* creases stay closed that were to open")  # of the crane
@pytest.mark.parametrize(
    "check", [*beyond(SHORT, 4), *beyond(LONG, 8)], ids=lambda check: check.__name__
)
def test_example(check, tmp_path, monkeypatch, capsys):
    """Of films a few pictures, of sweeps a few points; both have tests of their own."""
    monkeypatch.chdir(tmp_path)
    animate = fd.plots.animate
    monkeypatch.setattr(fd.plots, "animate", lambda *of, **how: animate(*of, **how | {"frames": 3}))
    monkeypatch.setattr(fd, "sweep", fewer(fd.sweep))
    check(runpy.run_path(str(ROOT / "examples" / f"{check.__name__}.py"), run_name="__main__"))
    assert capsys.readouterr().out
    assert {path.suffix for path in tmp_path.iterdir()} & {".png", ".gif"}


def test_examples_are_short_scripts_with_a_picture_each():
    assert [path.stem for path in EXAMPLES] == [check.__name__ for check in CHECKS]
    gallery = (ROOT / "docs" / "gallery.md").read_text("utf-8")
    for path in EXAMPLES:
        assert len(path.read_text("utf-8").splitlines()) < 40, path.name
        assert f"examples/{path.name}" in gallery, path.name


@pytest.mark.parametrize("path", beyond(SCRIPTS, 3), ids=lambda p: p.stem)
def test_figures(path):
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    script = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = script  # where dataclasses look for it
    spec.loader.exec_module(script)
    script.check(script.compute()[1])
