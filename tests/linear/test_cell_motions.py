"""Motions of the cells of finite chains, beside the bands of the cell that they repeat."""

from __future__ import annotations

import numpy as np
import pytest
from kresling_chains import HEAVIER, TRUSS, UNIT, branches, cell, decay, diatomic, motion

import foldyn as fd
from foldyn.errors import InputError
from foldyn.linear import attenuation, space_time, transmission, wave_spectrum
from foldyn.linear.cell_motions import cells_of
from verification.waves.kresling import guided

SHEET = fd.Sheet(1e9, 0.3, 1e-3, 1000.0)
TIME = np.linspace(0.0, 1.0, 41)


def miura(cells):
    return fd.Case(
        fd.discretize(fd.patterns.miura(cells=cells, a=0.03, b=0.03), SHEET, preset="plate")
    )


def test_a_rigid_screw_motion_turns_and_moves_all_cells_alike():
    nodes = UNIT.structure(6).nodes
    angle, rise = 2.5 * TIME, 0.3 * TIME
    turned = np.array([
        nodes @ np.array([[np.cos(a), np.sin(a), 0], [-np.sin(a), np.cos(a), 0], [0, 0, 1]])
        for a in angle
    ])  # fmt: skip
    moved = turned - nodes
    moved[..., 2] += rise[:, None]
    speed = np.cross((0.0, 0.0, 2.5), turned) + np.array([0.0, 0.0, 0.3])
    run = motion(nodes, moved, speed, TIME)
    found, turn = space_time(run, cell()), space_time(run, cell(), component="rotation")
    assert found.sizes["cell"] == 7
    np.testing.assert_allclose(found.displacement, rise[:, None] * np.ones(7), atol=1e-14)
    np.testing.assert_allclose(turn.displacement, angle[:, None] * np.ones(7), atol=1e-12)
    np.testing.assert_allclose(turn.velocity, 2.5, rtol=1e-12)
    np.testing.assert_allclose(found.strain, 0.0, atol=1e-13)


def test_strain_is_elongation_over_height():
    nodes = UNIT.structure(5).nodes
    moved = np.zeros((2, *nodes.shape))
    moved[1, :, 2] = 0.02 * nodes[:, 2]
    found = space_time(motion(nodes, moved, moved, np.array([0.0, 1.0])), cell())
    np.testing.assert_allclose(found.strain[1], 0.02, rtol=1e-12)
    np.testing.assert_allclose(found.position, UNIT.height * np.arange(6), rtol=1e-12)


@pytest.mark.parametrize("along", [0, 1])
def test_a_bloch_wave_of_a_sheet_peaks_at_its_phase(along):
    """Rows of a sheet that is not as long as it is wide, along both periods."""
    one, sheet = fd.UnitCell(miura((1, 1))), miura((8, 5))
    count, bins, f = (8, 5)[along], 2, 6.0
    phase = 2.0 * np.pi * bins / count
    wave_vector = phase * np.eye(2)[along]
    shape = fd.bands(one, [wave_vector], count=3, shape=True)["shape"].values[0, 2]
    nodes = sheet.structure.nodes
    vectors, own = one.vectors, one.case.structure.nodes
    moved = np.zeros((40, *nodes.shape))
    time = np.arange(40) / 40.0
    for i in range(9):
        for j in range(6):
            step = np.array([i, j])
            distance = np.linalg.norm(nodes[:, None] - own - step @ vectors, axis=2)
            here, unit = np.nonzero(distance < 1e-9)
            turns = 2.0 * np.pi * f * time - step @ wave_vector  # exp(i k R) of waves exp(-i w t)
            waves = shape[unit] * np.exp(-1j * turns)[:, None, None]
            moved[:, here] = waves.real
    found = wave_spectrum(motion(nodes, moved, moved, time), one, along=along, window=None)
    k, m = np.unravel_index(found.amplitude.values.argmax(), found.amplitude.shape)
    assert float(found.phase[k]) == pytest.approx(phase, rel=1e-12)
    assert float(found.frequency[m]) == pytest.approx(f, rel=1e-12)


@pytest.fixture(scope="module")
def tapped():
    """A chain of 40 cells after a tap on its first plate."""
    case = UNIT.chain(40)
    push = np.zeros_like(case.structure.nodes)
    push[:6, 2] = 1e-3
    return fd.simulate(
        case, 1.5, method="rk4", dt=2e-4, interval=2e-3, initial=fd.State(velocity=push)
    )


@pytest.mark.matrix
@pytest.mark.filterwarnings("ignore:panels that stretch hold")
def test_the_spectrum_of_a_small_motion_peaks_on_the_bands(tapped):
    found = wave_spectrum(tapped, cell())
    phases, step = found.phase.values, found.attrs["phase_step"]
    assert step == pytest.approx(2.0 * np.pi / 41)
    inner = np.abs(phases) > 2.0 * step
    lines = guided(fd.bands(cell(), phases[inner, None], count=4, shape=True, track=False))
    ends = guided(fd.bands(cell(), phases[inner, None] + step, count=4, shape=True, track=False))
    widths = found.attrs["frequency_step"] + np.abs(ends - lines)
    size, strong = found.amplitude.values[inner], []
    for row, line, width in zip(size, lines, widths, strict=True):
        f = float(found.frequency[row.argmax()])
        near = np.abs(line - f) <= width
        assert near.any(), (f, line)
        strong.append(int(np.flatnonzero(near)[0]))
    assert set(strong) == {0, 1}  # of both bands


@pytest.mark.matrix
def test_energy_and_momenta_are_kept_in_an_impact(tapped):
    case = UNIT.chain(40)
    mass = np.asarray(case.mass.sum(axis=0)).ravel()
    assert tapped.attrs["energy_error"] < 1e-3
    momentum = np.einsum("n,tna->ta", mass, tapped.velocity.values)
    size = np.einsum("n,tn->t", mass, np.linalg.norm(tapped.velocity.values, axis=2)).max()
    np.testing.assert_allclose(momentum, momentum[:1].repeat(len(momentum), 0), atol=1e-11 * size)
    place = case.structure.nodes + tapped.displacement.values
    turning = np.einsum("n,tna->ta", mass, np.cross(place, tapped.velocity.values))[:, 2]
    assert np.abs(turning).max() < 1e-10 * size * UNIT.radius


@pytest.fixture(scope="module")
def shaken():
    """A chain of 16 pairs of cells on a base that shakes along it."""
    case = diatomic(16)
    held = fd.Case(
        case.structure, [fd.Fix(range(6), "xyz"), *case.supports[3:]], masses=case.masses
    )
    low, high = np.sqrt(2.0 * branches()[1] / (HEAVIER, 1.0)) / (2.0 * np.pi)
    frequencies = np.linspace(0.6 * low, 1.1 * high, 61)
    return fd.frf(held, fd.BaseMotion("z"), frequencies=frequencies), (low, high)


def test_transmission_is_least_inside_the_gap(shaken):
    response, (low, high) = shaken
    pair = fd.UnitCell(diatomic(1, rings=2))
    phases = np.linspace(0.05, np.pi, 21)
    lines = fd.bands(pair, phases, count=8, polarization=True, track=False)
    level = lines.polarization.values[..., 2] < 1e-9  # plates slide sideways
    along = np.sort(np.where(level, np.inf, lines.frequency.values), axis=1)
    np.testing.assert_allclose(
        (along[:, 2].max(), along[:, 3].min()), (low, high), rtol=2e-4
    )  # two slow bands, and the fast one in two parts
    found = transmission(response, pair)
    best = float(found.frequency[int(found.ratio.values.argmin())])
    band = found.ratio.values[found.frequency.values < 0.97 * low]
    assert low < best < high
    assert found.ratio.min() < 1e-6 * np.median(band)


def test_decay_per_cell_is_the_imaginary_phase(shaken):
    response, (low, high) = shaken
    pair = fd.UnitCell(diatomic(1, rings=2))
    found = transmission(response, pair)
    f = found.frequency.values
    inside = (f > 1.03 * low) & (f < 0.97 * high)
    assert inside.sum() > 15
    np.testing.assert_allclose(found.decay[inside], decay(f[inside]), rtol=0.02)
    waves = attenuation(pair, f[inside], count=8)
    off = np.abs(waves.phase.values.imag / decay(f[inside])[:, None] - 1.0)
    assert off.min(axis=1).max() < 5e-3  # the other waves slide sideways
    assert np.abs(found.decay[f < 0.9 * low]).max() < 0.05


def test_rows_of_incomplete_cells_are_left_out():
    nodes = miura((4, 2)).structure.nodes
    found = cells_of(nodes, fd.UnitCell(miura((1, 1))))
    assert len(found.nodes) == 4
    steps = np.diff(nodes[found.nodes], axis=0)
    np.testing.assert_allclose(steps, np.broadcast_to(found.motion.vector, steps.shape), atol=1e-12)


def test_cells_of_a_ring_are_found_and_do_not_advance():
    """A sixth of a storey, which a turn repeats; here the whole storey moves outward."""
    storey = fd.patterns.kresling(6, 0.05, height=0.05, twist=20.0)
    faces = [face for face in storey.faces if set(face) <= {0, 1, 6, 7}]
    part = fd.Pattern(storey.vertices[[0, 1, 6, 7]], [[f % 6 + f // 6 * 2 for f in face]
                                                    for face in faces])  # fmt: skip
    one = fd.UnitCell(
        fd.Case(fd.discretize(part, SHEET, preset="plate")),
        screw=fd.Screw("z", angle=60.0, shift=0.0),
    )
    nodes = storey.vertices
    moved = np.zeros((4, *nodes.shape))
    moved[1:, :, :2] = 0.1 * nodes[:, :2]
    run = motion(nodes, moved, moved, np.arange(4.0))
    found = space_time(run, one, component="x")
    assert found.sizes["cell"] == 6
    assert "strain" not in found
    np.testing.assert_allclose(found.displacement[1], float(found.displacement[1, 0]), rtol=1e-9)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda run: space_time(run, fd.UnitCell(miura((1, 1)))), "1 of these cells"),
        (lambda run: space_time(run, "cell"), "UnitCell"),
        (lambda run: space_time(run, cell(), component="radial"), "component"),
        (lambda run: space_time(run, cell(), along=1), "along = 1: the cell has 1 period"),
        (lambda run: space_time(run.drop_vars("velocity"), cell()), "velocity"),
        (lambda run: space_time(5, cell()), "give a motion"),
        (lambda run: wave_spectrum(run, cell(), component="rotation"), "component"),
        (lambda run: transmission(run, cell()), "frequency response"),
    ],
)
def test_what_is_no_motion_of_these_cells_is_refused(call, words):
    nodes = TRUSS.structure(4).nodes
    still = np.zeros((5, *nodes.shape))
    with pytest.raises(InputError, match=words):
        call(motion(nodes, still, still, np.arange(5.0)))


def test_sheets_do_not_rotate():
    nodes = miura((4, 1)).structure.nodes
    still = np.zeros((5, *nodes.shape))
    with pytest.raises(InputError, match="without an axis"):
        space_time(
            motion(nodes, still, still, np.arange(5.0)),
            fd.UnitCell(miura((1, 1))),
            component="rotation",
        )
