"""Load histories, constitutive curves and energies."""

from __future__ import annotations

import numpy as np
import pytest
from pictures import keys

from foldyn import cases, patterns, structures
from foldyn.errors import InputError
from foldyn.plots import plot_energies, plot_laws, plot_load_history


def test_load_history_is_force_times_factor(case):
    figure = plot_load_history(case, duration=2.0)
    (axes,) = figure.axes
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("time (s)", "force at a node (N)")
    line = axes.get_lines()[0]
    t = line.get_xdata()
    assert t[0] == 0.0 and t[-1] == 2.0
    exact = np.where(t < 0.5, 0.01 * np.sin(np.pi * t / 0.5), 0.0)
    np.testing.assert_allclose(line.get_ydata(), exact, atol=1e-15)
    assert keys(figure) == ["0.01 N along +x on node 7: half sine (duration 0.5)"]


def test_one_curve_per_history(structure):
    loads = [
        cases.Force([3, 5], (0.0, 0.0, -2.0)),
        cases.Force([7], (3.0, 0.0, 4.0), cases.Harmonic(2.0)),
    ]
    figure = plot_load_history(cases.Case(structure, loads=loads), 1.0)
    steady, wave = figure.axes[0].get_lines()[:2]
    np.testing.assert_allclose(steady.get_ydata(), 2.0)
    assert wave.get_ydata().max() == pytest.approx(5.0, rel=1e-4)
    assert keys(figure) == [
        "2 N along -z on nodes 3, 5: constant",
        "5 N along (0.6, 0, 0.8) on node 7: harmonic (frequency 2, phase 0)",
    ]


def test_gravity_has_axes_of_its_own(structure):
    loads = [
        cases.Force([7], (0.01, 0.0, 0.0), cases.Chirp(1.0, 5.0, 2.0)),
        cases.Gravity((0.0, 0.0, -9.81), cases.Ramp(1.0)),
    ]
    figure = plot_load_history(cases.Case(structure, loads=loads), 2.0)
    force, gravity = figure.axes
    assert [a.get_ylabel() for a in figure.axes] == ["force at a node (N)", "gravity (m/s2)"]
    assert [a.get_xlabel() for a in figure.axes] == ["", "time (s)"]
    assert force.get_lines()[0].get_ydata().max() == pytest.approx(0.01, rel=1e-4)
    line = gravity.get_lines()[0]
    np.testing.assert_allclose(line.get_ydata(), 9.81 * np.minimum(line.get_xdata(), 1.0))
    assert keys(figure) == [
        "0.01 N along +x on node 7: chirp (from_frequency 1, to_frequency 5, duration 2, phase 0)",
        "gravity 9.81 m/s2 along -z: ramp (duration 1)",
    ]
    alone = plot_load_history(cases.Case(structure, loads=loads[1:]), 2.0)
    assert [a.get_ylabel() for a in alone.axes] == ["gravity (m/s2)"]


def test_a_users_function_is_named(structure):
    def gust(t):
        return np.tanh(t)

    load = cases.Force([7], (1.0, 0.0, 0.0), gust)
    figure = plot_load_history(cases.Case(structure, loads=[load]), 1.0)
    assert figure.legends[0].get_texts()[0].get_text().endswith(": gust")


def test_case_without_loads_says_so(structure):
    figure = plot_load_history(cases.Case(structure), 1.0)
    assert [text.get_text() for text in figure.axes[0].texts] == ["no loads"]


def test_load_history_needs_a_duration(case):
    with pytest.raises(InputError, match="duration"):
        plot_load_history(case, 0.0)


def test_laws_of_a_miura_cell(structure):
    figure = plot_laws(structure)
    fold, bend, bar = figure.axes
    hinge = ("dihedral (degrees)", "moment (N m)")
    labels = [(a.get_xlabel(), a.get_ylabel()) for a in (fold, bend, bar)]
    assert labels == [hinge, hinge, ("stretch (-)", "second Piola-Kirchhoff stress (Pa)")]
    # A bend is superlinear: k sgn(d) |d|^(4/3) about the flat panel.
    curve = bend.get_lines()[0]
    d = np.radians(curve.get_xdata()) - np.pi
    k = structure.bend_stiffness
    exact = np.sign(d) * np.abs(d) ** (4 / 3)
    ratio = curve.get_ydata()[d != 0] / exact[d != 0]
    np.testing.assert_allclose(ratio, ratio[0], rtol=1e-9)
    assert np.isclose(k, ratio[0]).any()
    # Ogden: E/4 (l^3 - 1/l), here with E = 1e6 Pa.
    stress = bar.get_lines()[0]
    stretch = stress.get_xdata()
    np.testing.assert_allclose(
        stress.get_ydata(), 0.25e6 * (stretch**3 - 1 / stretch), rtol=1e-9, atol=1e-4
    )


def test_rest_angles_are_marked_without_moment(structure):
    fold = plot_laws(structure).axes[0]
    (dots,) = [line for line in fold.get_lines() if line.get_marker() == "o"]
    shown = sorted(dots.get_xdata())
    rests = np.unique(np.round(np.degrees(structure.fold_rest), 6))
    np.testing.assert_allclose(shown, rests, atol=1e-5)
    np.testing.assert_allclose(dots.get_ydata(), 0.0, atol=1e-12)
    texts = [text.get_text() for text in fold.get_legend().get_texts()]
    assert len(texts) == len(rests)
    assert all("N m/rad, rest" in text for text in texts)


@pytest.mark.matrix
def test_equal_hinges_share_a_curve_and_many_are_counted(pattern):
    sheet = structures.Sheet(1e6, 0.25, 0.01)
    different = structures.discretize(
        pattern,
        sheet,
        crease_stiffness=[0.1, 0.2, 0.3, 0.4],
        crease_rest=[60, 300, 60, 300],
        preset="plate",
    )
    fold = plot_laws(different).axes[0]
    assert len(fold.get_legend().get_texts()) == 4
    corners = [(x, y) for y in range(3) for x in range(4)]
    flat = patterns.Pattern(corners, [(k, k + 1, k + 5, k + 4) for k in (0, 1, 2, 4, 5, 6)])
    equal = structures.discretize(flat, sheet, preset="herkal")
    fold = plot_laws(equal).axes[0]
    (text,) = fold.get_legend().get_texts()
    assert "and 6 more" in text.get_text()
    many = structures.discretize(flat, sheet, crease_stiffness=np.arange(1.0, 8.0), preset="plate")
    legend = plot_laws(many).axes[0].get_legend()
    assert len(legend.get_texts()) == 4
    assert legend.get_title().get_text() == "3 other pairs of k and rest not shown"


def test_triangles_have_no_bends(pattern):
    triangle = patterns.Pattern([(0, 0), (1, 0), (0, 1), (1, 1)], [(0, 1, 2), (1, 3, 2)])
    s = structures.discretize(triangle, structures.Sheet(1e6, 0.25, 0.01), preset="plate")
    titles = [axes.get_title() for axes in plot_laws(s).axes]
    assert [title.split(":")[0] for title in titles] == ["folds", "bars"]


def test_laws_need_a_range_of_stretch(structure):
    with pytest.raises(InputError, match="stretch"):
        plot_laws(structure, stretch=(1.2, 0.8))


def test_energies_and_their_balance(trajectory):
    figure = plot_energies(trajectory)
    upper, lower = figure.axes
    assert upper.get_ylabel() == "energy (J)"
    assert (lower.get_xlabel(), lower.get_ylabel()) == ("time (s)", "balance error (J)")
    names = ["kinetic", "strain_bars", "strain_folds", "strain_bends", "dissipated", "work"]
    for line, name in zip(upper.get_lines(), names, strict=True):
        np.testing.assert_array_equal(line.get_ydata(), trajectory[name])
    # The motion was made with a balance that drifts by 1e-6 J per second.
    error = lower.get_lines()[0]
    np.testing.assert_allclose(error.get_ydata(), 1e-6 * trajectory["time"], atol=1e-14)
    assert "at most 1e-05 J" in lower.get_title(loc="right")
    assert keys(figure)[-1] == "work of the loads"


def test_prestress_does_not_flatter_the_balance(trajectory):
    strained = trajectory.assign(strain_bars=trajectory["strain_bars"] + 1e6)
    title = plot_energies(strained).axes[1].get_title(loc="right")
    assert title.endswith("1e-05 of the energy at play")  # 1e-5 J of 1 J


def test_missing_energy_is_named(trajectory):
    with pytest.raises(InputError, match="no work"):
        plot_energies(trajectory.drop_vars("work"))
