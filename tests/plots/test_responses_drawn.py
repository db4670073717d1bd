"""Frequency responses and Nyquist plots: the data in them, from modes with a known answer."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from pictures import assert_white_rim, keys

from foldyn.errors import InputError
from foldyn.linear import Peak, peaks_of
from foldyn.plots import plot_frf, plot_nyquist
from foldyn.plots.frf import phase_line
from foldyn.plots.nyquist import circles_of
from foldyn.results import frf_dataset
from foldyn.signals import exponential_window

F = np.linspace(0.0, 15.0, 301)
POLES = ((4.0, 0.02, 1.0), (9.0, 0.03, -0.3))  # Hz, damping ratio, modal constant (1/kg)


def receptance(f, poles=POLES):
    w = 2j * np.pi * f
    terms = [a / ((2 * np.pi * f0) ** 2 + w**2 + 2 * z * 2 * np.pi * f0 * w) for f0, z, a in poles]
    return np.sum(terms, axis=0)


def made(case, f=F, poles=POLES, quantity="receptance", coherence=None, facts=None):
    """Node 7 responds along x with the known modes, 6 along y with half of it, others not."""
    n = len(case.structure.nodes)
    response = np.zeros((len(f), n, 3), complex)
    response[:, 7, 0] = receptance(f, poles)
    response[:, 6, 1] = 0.5 * response[:, 7, 0]
    drive = np.zeros((n, 3))
    drive[7, 0] = 1.0
    more = {}
    if coherence is not None:
        more["coherence"] = np.full((len(f), n, 3), coherence)
    statistics = {"method": "direct", "base_axis": "x", **(facts or {})}
    return frf_dataset(case, f, quantity, response, np.zeros((n, 3)), drive, statistics, more)


@pytest.fixture
def response(case):
    return made(case)


def line(axes, label):
    (found,) = [curve for curve in axes.get_lines() if curve.get_label() == label]
    return found


def peak_dots(axes, label="response"):
    dots = line(axes, f"_peaks of {label}")
    return np.column_stack([dots.get_xdata(), dots.get_ydata()])


def test_magnitude_and_phase_are_those_of_the_response(response):
    figure = plot_frf({"one": response}, [7], axes="x")
    magnitude, phase = figure.axes
    curve = receptance(F)
    np.testing.assert_allclose(line(magnitude, "response").get_ydata(), np.abs(curve))
    assert magnitude.get_yscale() == "log"
    shown = phase.get_lines()[0]
    whole = np.isfinite(shown.get_ydata())
    np.testing.assert_allclose(shown.get_ydata()[whole], np.degrees(np.angle(curve)))
    np.testing.assert_array_equal(shown.get_xdata()[whole], F)
    assert magnitude.get_ylabel() == "receptance along x (m/N)"
    assert (phase.get_xlabel(), phase.get_ylabel()) == ("frequency (Hz)", "phase (degrees)")
    assert phase.get_xlim() == (0.0, 15.0)
    assert not figure.legends  # one curve explains itself


def test_peaks_are_marked_where_they_are_and_named(response):
    figure = plot_frf({"one": response}, [7], axes="x", prominence=0.01)
    dots = peak_dots(figure.axes[0])
    expected = [f0 * np.sqrt(1 - 2 * z**2) for f0, z, _ in POLES]
    np.testing.assert_allclose(dots[:, 0], expected, rtol=0.01)
    table = peaks_of(response, 7, axis="x", prominence=0.01)
    np.testing.assert_allclose(dots[:, 0], [peak.frequency for peak in table], rtol=1e-12)
    np.testing.assert_allclose(dots[:, 1], [peak.height for peak in table], rtol=1e-12)
    told = [text.get_text() for text in figure.axes[0].texts]
    assert told == [f"{f:#.4g} Hz" for f in dots[np.argsort(-dots[:, 1]), 0]]
    few = plot_frf({"one": response}, [7], axes="x", prominence=0.5)
    assert len(peak_dots(few.axes[0])) == 1


def test_labels_of_peaks_do_not_meet(case):
    near = made(case, poles=((4.0, 0.02, 1.0), (4.2, 0.02, 0.9), (9.0, 0.02, 1.0)))
    figure = plot_frf({"one": near}, [7], axes="x", prominence=0.01)
    assert len(peak_dots(figure.axes[0])) == 3
    assert len(figure.axes[0].texts) == 2  # of 4.0 and 4.2 Hz the higher one
    figure.canvas.draw()
    boxes = [text.get_window_extent() for text in figure.axes[0].texts]
    assert not boxes[0].overlaps(boxes[1])
    frame = figure.axes[0].get_window_extent()
    assert all(frame.y1 >= box.y1 for box in boxes)


@pytest.mark.parametrize(
    ("quantity", "factor", "unit"),
    [("mobility", 2j * np.pi * F, "m/(N s)"), ("accelerance", -((2 * np.pi * F) ** 2), "m/(N s²)")],
)
def test_other_quantities(response, quantity, factor, unit):
    figure = plot_frf({"one": response}, [7], axes="x", quantity=quantity)
    shown = line(figure.axes[0], "response").get_ydata()
    np.testing.assert_allclose(shown[1:], np.abs(factor * receptance(F))[1:])
    assert np.isnan(shown[0])  # nothing at 0 Hz, which has no place on a logarithmic axis
    assert figure.axes[0].get_ylabel() == f"{quantity} along x ({unit})"


def test_a_moving_base_gives_a_transmissibility(case):
    moved = made(case, quantity="transmissibility")
    figure = plot_frf({"one": moved}, [7], axes="x")
    assert figure.axes[0].get_ylabel() == "transmissibility along x"
    np.testing.assert_allclose(line(figure.axes[0], "response").get_ydata(), np.abs(receptance(F)))


def test_coherence_is_drawn_where_there_is_one(case, response):
    noisy = made(case, coherence=0.9)
    figure = plot_frf({"noisy": noisy, "exact": response}, [7], axes="x")
    magnitude, _, coherence = figure.axes
    assert coherence.get_ylabel() == "coherence"
    assert [curve.get_label() for curve in coherence.get_lines()] == ["noisy"]
    np.testing.assert_array_equal(coherence.get_lines()[0].get_ydata(), np.full(301, 0.9))
    assert line(coherence, "noisy").get_color() == line(magnitude, "noisy").get_color()


@pytest.mark.matrix
def test_models_and_nodes_are_told_apart(case, response):
    stiffer = made(case, poles=((5.0, 0.02, 1.0),))
    figure = plot_frf({"a": response, "b": stiffer}, [7, 6])
    ways = ("node 7 along x", "node 6 along y")
    assert keys(figure) == [*(f"{label}, {way}" for label in "ab" for way in ways), "peak"]
    magnitude, phase = figure.axes
    np.testing.assert_allclose(
        line(magnitude, "b, node 6 along y").get_ydata(),
        0.5 * np.abs(receptance(F, ((5.0, 0.02, 1.0),))),
    )
    curves = [line(magnitude, name) for name in keys(figure)[:-1]]
    looks = {(curve.get_color(), str(curve.get_linestyle())) for curve in curves}
    assert len(looks) == 4
    for curve in curves:
        assert line(phase, curve.get_label()).get_color() == curve.get_color()
    assert magnitude.get_ylabel() == "receptance (m/N)"
    assert keys(plot_frf({"a": response, "b": stiffer}, [7]))[:2] == ["a", "b"]


@pytest.mark.matrix
def test_responses_at_other_frequencies_share_the_frame(case, response):
    few = made(case, f=np.array([2.0, 4.0, 20.0]))
    figure = plot_frf({"fine": response, "stepped": few}, [7], axes="x")
    assert figure.axes[1].get_xlim() == (0.0, 20.0)
    stepped, fine = line(figure.axes[0], "stepped"), line(figure.axes[0], "fine")
    assert stepped.get_marker() == "."  # few frequencies are seen as such
    assert fine.get_marker() in ("", "None")


def test_a_phase_does_not_run_across_the_frame():
    f = np.arange(4.0)
    x, degrees = phase_line(f, np.exp(1j * np.radians([170.0, -170.0, -100.0, 100.0])))
    np.testing.assert_array_equal(np.isnan(degrees), [False, True, False, False, True, False])
    np.testing.assert_array_equal(x, [0, 1, 1, 2, 3, 3])
    # without damping the sign of the imaginary part is rounding
    _, flat = phase_line(f, np.array([-1 + 1e-18j, -1 - 1e-18j, -1 + 0j, -1 - 0j]))
    np.testing.assert_allclose(flat, -180.0)


@pytest.mark.matrix
def test_frequencies_without_a_response_are_left_out(case):
    broken = made(case)
    broken["receptance"][80] = np.nan
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        figure = plot_frf({"one": broken}, [7])  # the direction is found all the same
        assert np.isnan(line(figure.axes[0], "response").get_ydata()[80])
        figure.canvas.draw()


@pytest.mark.matrix
def test_a_node_that_does_not_move_and_few_frequencies(case, response):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        still = plot_frf({"one": response}, [7, 3], axes="x")
        still.canvas.draw()
        two = plot_frf({"one": made(case, f=np.array([4.0]))}, [7], axes="x")
        two.canvas.draw()
    assert np.isnan(line(still.axes[0], "node 3").get_ydata()).all()
    assert not len(peak_dots(two.axes[0]))


@pytest.mark.matrix
def test_nothing_is_cut_off(case):
    noisy = made(case, coherence=0.5)
    for figure in (
        plot_frf({"a": noisy, "b": noisy}, [6, 7], title="Responses"),
        plot_nyquist(noisy, 7, axis="x", title="Circles"),
    ):
        assert_white_rim(figure)


def test_circles_go_through_the_mobility(response):
    figure = plot_nyquist(
        response, 7, axis="x", peaks=peaks_of(response, 7, axis="x", prominence=0.01)
    )
    assert len(figure.axes) == 2
    for frame, (f0, z, a) in zip(figure.axes, POLES, strict=True):
        assert frame.get_aspect() == 1.0
        told, ratio = frame.get_title().split(" Hz, damping ")
        assert float(told) == pytest.approx(f0, rel=1e-3)
        assert float(ratio.removesuffix(" %")) == pytest.approx(100 * z, rel=1e-2)
        circle, points = line(frame, "fitted circle"), line(frame, "response")
        x, y = circle.get_xdata(), circle.get_ydata()
        center = np.array([x[:-1].mean(), y[:-1].mean()])
        radius = np.hypot(x - center[0], y - center[1])
        # the diameter of a mode's mobility is A / (2 z w0)
        np.testing.assert_allclose(radius, abs(a) / (8 * np.pi * z * f0), rtol=0.04)
        away = np.hypot(points.get_xdata() - center[0], points.get_ydata() - center[1])
        np.testing.assert_allclose(away, radius[0], rtol=0.06)
        top = line(frame, "natural frequency")
        assert np.sign(top.get_xdata()[0] - center[0]) == np.sign(a)
    assert keys(figure) == ["response", "fitted circle", "natural frequency"]


def test_a_circle_of_a_windowed_response_has_the_damping_of_the_window():
    """The peak tells the damping of the structure, the curve has the window's added."""
    dt, rate, w0, z = 0.005, 3.0, 2 * np.pi * 4.0, 0.02
    t = np.arange(4000) * dt
    pulse = np.exp(-z * w0 * t) * np.sin(w0 * np.sqrt(1 - z**2) * t)
    windowed = pulse * exponential_window(len(t), dt, rate=rate)
    f = np.fft.rfftfreq(len(t), dt)
    Y = 2j * np.pi * f * np.fft.rfft(windowed) * dt
    band = (f > 2.0) & (f < 6.0)
    (circle,) = circles_of(
        f[band], Y[band], [Peak(4.0, 1.0, natural_frequency=4.0, damping_ratio=z)], rate
    )
    assert circle.ratio == pytest.approx(z + rate / w0, rel=1e-2)
    misfit = np.abs(circle(f[band][circle.band]) - Y[band][circle.band])
    assert misfit.max() < 0.01 * abs(circle.diameter)
    (wrong,) = circles_of(
        f[band], Y[band], [Peak(4.0, 1.0, natural_frequency=4.0, damping_ratio=z)]
    )
    assert np.abs(wrong(f[band][wrong.band]) - Y[band][wrong.band]).max() > 0.1 * abs(
        wrong.diameter
    )


def test_without_a_circle_the_whole_curve_is_drawn(case):
    smooth = made(case, poles=((50.0, 0.02, 1.0),))
    figure = plot_nyquist(smooth, 7)
    (frame,) = figure.axes
    assert frame.get_title() == "no circle fits"
    (curve,) = [c for c in frame.get_lines() if len(c.get_xdata()) > 2]
    expected = 2j * np.pi * F * receptance(F, ((50.0, 0.02, 1.0),))
    np.testing.assert_allclose(curve.get_ydata(), expected.imag[1:])
    assert keys(figure) == ["response"]


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda r: plot_frf({}, [7]), "responses: give a result, or a mapping"),
        (lambda r: plot_frf({"a": r}, []), "nodes = ..: give nodes"),
        (lambda r: plot_frf(r, [7.5]), "nodes = 7.5: must be a whole number"),
        (lambda r: plot_frf({"a": r}, [13]), "13 is not in 'a', whose nodes are 0..12"),
        (lambda r: plot_frf({"a": r}, [7, 6], axes=["x", "y", "z"]), "3 directions for 2 nodes"),
        (
            lambda r: plot_frf({"a": r}, [7], axes="x", quantity="speed"),
            "quantity: 'speed'; the response has",
        ),
        (lambda r: plot_frf({"a": r}, [7], prominence=1.0), "prominence = 1.0: must be"),
        (lambda r: plot_nyquist(r, 13), "13 is not in"),
        (lambda r: plot_nyquist(r, 7, axis="w"), '"w": choose one of x, y, z'),
    ],
)
def test_bad_input(response, call, words):
    with pytest.raises(InputError, match=words):
        call(response)


def test_what_a_moving_base_cannot_be(case, response, trajectory):
    moved = made(case, quantity="transmissibility")
    with pytest.raises(InputError, match="forces drive some, a moving base others"):
        plot_frf({"a": response, "b": moved}, [7])
    with pytest.raises(InputError, match="'mobility'; the response has transmissibility"):
        plot_frf({"b": moved}, [7], quantity="mobility")
    with pytest.raises(InputError, match="a base drives it; circles need forces"):
        plot_nyquist(moved, 7)
    with pytest.raises(InputError, match=r"frequency response, .*fd\.frf"):
        plot_frf({"a": trajectory}, [7])


def test_a_response_alone_needs_no_label(response):
    figures = [plot_frf(given, [7, 6]) for given in (response, {"one": response})]
    assert keys(figures[0]) == keys(figures[1])
    for one, other in zip(*(figure.axes for figure in figures), strict=True):
        np.testing.assert_array_equal(*(a.get_lines()[0].get_xydata() for a in (one, other)))
