"""Fits to natural frequencies, damping ratios, mode shapes and frequency responses."""

from __future__ import annotations

from dataclasses import replace

import fit_cases
import numpy as np
import pytest
from fit_cases import refused

import foldyn as fd
from case_texts import HELD_FOLD_TEXT, HELD_MIURA_TEXT, PLATE
from foldyn.errors import InputError
from foldyn.experiment import (
    DampingRatios,
    FrequencyResponse,
    ModeShapes,
    NaturalFrequencies,
    Parameter,
)
from foldyn.experiment.calibration.fit_problem import problem
from pairwise import FEW

DAMPED = HELD_MIURA_TEXT + PLATE + "[damping]\nalpha = 0.4\n"
MODES = DAMPED + '[analysis]\nkind = "modes"\ncount = 4\n'
FRF = (
    DAMPED
    + '[[drive]]\nnodes = [8]\nforce = [0, 0, 1]\n[analysis]\nkind = "frf"\nfrequencies = [1]\n'
)
FREE = [3, 4, 5, 6, 7, 8]
LINES = np.linspace(0.2, 2.8, 14)
MODULUS = Parameter("sheet.youngs_modulus", 1.2e6, 1e5, 1e7)
NEAR = replace(MODULUS, guess=1.03e6)  # peaks that are apart by more than their width do not meet
RATIO = Parameter("sheet.length_scale_ratio", 1.6, 0.2, 20.0)
ALPHA = Parameter("damping.alpha", 0.6, 0.0, 5.0)
TRUTH = {MODULUS.key: 1e6, RATIO.key: 1.0, ALPHA.key: 0.4}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("miura")
    fit_cases.write(place, MODES, "modes.toml")
    fit_cases.write(place, FRF, "frf.toml")
    fit_cases.write(
        place, HELD_FOLD_TEXT + PLATE + '[analysis]\nkind = "modes"\ncount = 4\n', "fold.toml"
    )
    return place


@pytest.fixture(scope="module")
def modes(folder):
    return fd.read_case(folder / "modes.toml").run(count=6)


@pytest.fixture(scope="module")
def response(folder):
    return fd.read_case(folder / "frf.toml").run(frequencies=LINES)


def shapes(modes, places=(0, 1, 2, 3), noise=0.0, seed=0, **known) -> ModeShapes:
    """Shapes of modes at the nodes that move, with noise in parts of the largest component."""
    exact = modes["shape"].values[list(places)][:, FREE]
    largest = np.abs(exact).max(axis=(1, 2), keepdims=True)
    draw = np.random.default_rng(seed).standard_normal(exact.shape)
    return ModeShapes(nodes=FREE, values=exact + noise * largest * draw, **known)


def frequencies(modes, noise=0.0, seed=0, **known) -> NaturalFrequencies:
    exact = modes["frequency"].values[:4]
    draw = np.random.default_rng(seed).standard_normal(4)
    return NaturalFrequencies(frequency=exact * (1.0 + noise * draw), **known)


def receptances(response, noise=0.0, seed=0, magnitude=False, **known) -> FrequencyResponse:
    exact = response["receptance"].sel(node=[6, 8], axis="z").values
    draw = np.random.default_rng(seed).standard_normal((2, *exact.shape))
    values = exact + noise * (draw[0] + 1j * draw[1])
    return FrequencyResponse(
        nodes=[6, 8], axis="z", frequency=LINES, values=np.abs(values) if magnitude else values,
        magnitude=magnitude, **known,
    )  # fmt: skip


def kinds(modes, response, seed):
    """Each kind of data with its noise, and the parameters that it determines."""
    seen = frequencies(modes, 2e-3, seed)
    damping = modes["damping_ratio"].values[:4]
    drawn = damping + 1e-3 * np.random.default_rng(seed + 100).standard_normal(4)
    return {
        "frequencies": (
            [replace(seen, sigma=2e-3 * modes["frequency"].values[:4])], [MODULUS, RATIO],
        ),
        "damping_ratios": ([DampingRatios(damping_ratio=drawn, sigma=1e-3)], [ALPHA]),
        "mode_shapes": ([shapes(modes, noise=0.02, seed=seed, sigma=0.02)], [RATIO]),
        "frf": ([receptances(response, 0.05, seed, sigma=0.05)], [NEAR, ALPHA]),
        "magnitudes": (
            [receptances(response, 0.05, seed, magnitude=True, sigma=0.05)], [NEAR, ALPHA],
        ),
    }  # fmt: skip


@pytest.mark.matrix
@pytest.mark.parametrize(
    "kind", ["frequencies", "damping_ratios", "mode_shapes", "frf", "magnitudes"]
)
def test_noisy_data_give_the_parameters_and_intervals_that_contain_them(
    folder, modes, response, kind
) -> None:
    case = folder / ("frf.toml" if kind in ("frf", "magnitudes") else "modes.toml")
    inside, misfits = [], []
    for seed in range(1 if FEW else 3):
        data, parameters = kinds(modes, response, seed)[kind]
        found = fd.fit(case, data, parameters=parameters)
        misfits.append(found.misfit)
        for one in found.estimates:
            truth = TRUTH[one.key]
            assert one.determined
            assert one.value == pytest.approx(truth, rel=0.1)
            inside.append(one.lower < truth < one.upper)
            assert one.discretization == 0.0
    assert sum(inside) >= len(inside) - 1
    least = 0.2 if FEW else 0.5  # few data scatter more
    assert least < np.sqrt(np.mean(np.square(misfits))) < 1.5


@pytest.mark.matrix
def test_all_kinds_together(folder, modes, response) -> None:
    data = [
        frequencies(modes, 2e-3, sigma=1e-3),
        shapes(modes, noise=0.02, sigma=0.02),
        replace(receptances(response, 0.05, sigma=0.05), case=folder / "frf.toml"),
    ]
    found = fd.fit(folder / "modes.toml", data, parameters=[NEAR, replace(RATIO, guess=1.1), ALPHA])
    for one in found.estimates:
        assert one.lower < TRUTH[one.key] < one.upper
    assert len(found.problem.runs) == 2
    assert [score.unit for score in found.scores] == ["Hz", "", "m/N"]


@pytest.mark.matrix
def test_sign_and_size_of_shapes_do_not_matter(folder, modes) -> None:
    one = shapes(modes, noise=0.02, sigma=0.02)
    scaled = one.values * np.array([-3.0, 0.1, 7.0, -1.0])[:, None, None]
    first, second = (
        fd.fit(folder / "modes.toml", [data], parameters=[RATIO])
        for data in (one, replace(one, values=scaled))
    )
    assert second.values[RATIO.key] == pytest.approx(first.values[RATIO.key], rel=1e-5)
    # a scale for each of four shapes is not left to tell the noise
    assert first.freedom == one.values.size - 4 - 1


def test_what_is_left_of_shapes_is_what_their_mac_lacks(folder, modes) -> None:
    one = shapes(modes, noise=0.1, sigma=0.1)
    (said,) = problem(folder / "modes.toml", [one], [RATIO], {}).predict([1.0])
    left = ((said - one.observed()).reshape(one.values.shape) ** 2).sum(axis=(1, 2))
    whole = (one.values**2).sum(axis=(1, 2))
    alike = fd.mac(one.values, modes["shape"].values[:4][:, FREE])
    np.testing.assert_allclose(left / whole, 1.0 - np.diag(alike), rtol=1e-9)


@pytest.mark.matrix
def test_shapes_find_modes_of_which_the_lowest_was_missed(folder) -> None:
    """In their order the two frequencies would belong to the first and second mode."""
    soft = folder / "soft.toml"
    soft.write_text(MODES.replace("density", "length_scale_ratio = 10\ndensity"))
    true = fd.read_case(soft).run(count=4)
    seen = true["frequency"].values[1:3]
    ratio = Parameter("sheet.length_scale_ratio", 8.0, 0.2, 50.0)
    # at L*/L_F = 3 and below the two lowest modes have changed places
    stiff = Parameter("sheet.length_scale_ratio", 2.5, 0.2, 50.0)
    paired = NaturalFrequencies(frequency=seen, shapes=shapes(true, (1, 2)), sigma=1e-3)
    for start in (ratio, stiff):
        found = fd.fit(soft, [paired], parameters=[start])
        assert found.values[ratio.key] == pytest.approx(10.0, rel=1e-4)
        assert "sigma is too large" in found.quality  # the data have no noise
    in_order = fd.fit(soft, [NaturalFrequencies(frequency=seen, sigma=1e-3)], parameters=[ratio])
    assert in_order.misfit > 10.0
    assert "more than noise explains" in in_order.quality
    numbered = NaturalFrequencies(frequency=seen, mode=[2, 3], sigma=1e-3)
    assert fd.fit(soft, [numbered], parameters=[ratio]).values[ratio.key] == pytest.approx(
        10.0, rel=1e-4
    )


def test_components_that_were_not_measured_are_left_out(folder, modes, response) -> None:
    one, two = shapes(modes, sigma=0.01), receptances(response, sigma=0.01)
    holed = one.values.copy()
    holed[1, 2] = np.nan
    lost = two.values.copy()
    lost[3, 1] = np.nan
    (said,) = problem(folder / "modes.toml", [replace(one, values=holed)], [RATIO], {}).predict([1])
    assert len(said) == one.values.size - 3
    np.testing.assert_allclose(said, replace(one, values=holed).observed(), atol=1e-9)
    (said,) = problem(folder / "frf.toml", [replace(two, values=lost)], [ALPHA], {}).predict([0.4])
    assert len(said) == 2 * (two.values.size - 1)
    np.testing.assert_allclose(said, replace(two, values=lost).observed(), atol=1e-9)


@pytest.mark.parametrize("quantity", ["mobility", "accelerance"])
def test_velocities_and_accelerations_per_force(folder, response, quantity) -> None:
    seen = fd.linear.convert(response, quantity)[quantity].sel(node=[6], axis="z").values
    one = FrequencyResponse(nodes=[6], axis="z", frequency=LINES, values=seen, quantity=quantity)
    (said,) = problem(folder / "frf.toml", [one], [ALPHA], {}).predict([0.4])
    np.testing.assert_allclose(said, one.observed(), rtol=1e-9, atol=1e-12)


@pytest.mark.matrix
def test_a_moving_base_gives_a_transmissibility(tmp_path) -> None:
    drive = "[[drive]]\nnodes = [8]\nforce = [0, 0, 1]\n"
    path = fit_cases.write(tmp_path, FRF.replace(drive, '[[drive]]\nbase = "z"\n'))
    seen = fd.read_case(path).run(frequencies=LINES).transmissibility.sel(node=[6], axis="z").values
    one = FrequencyResponse(
        nodes=[6], axis="z", frequency=LINES, values=seen, quantity="transmissibility"
    )
    assert fd.fit(path, [one], parameters=[ALPHA]).values[ALPHA.key] == pytest.approx(0.4, rel=1e-6)
    with pytest.raises(InputError, match="the case is driven by a base, which gives transmiss"):
        problem(path, [replace(one, quantity="receptance")], [ALPHA], {})


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: NaturalFrequencies(frequency=[2.0, 1.0]), "1 Hz comes after 2 Hz; sort"),
        (lambda: NaturalFrequencies(frequency=[-1.0, 1.0]), "frequency = -1: must be greater"),
        (lambda: NaturalFrequencies(frequency=[0.0, 1.0]), "leave out rigid motions"),
        (lambda: NaturalFrequencies(frequency=[]), "shape (0,): must be a list of numbers"),
        (lambda: NaturalFrequencies(frequency=[1, 2], mode=[2, 1]), "must be the increasing"),
        (lambda: NaturalFrequencies(frequency=[1, 2], mode=[0, 1]), "must be the increasing"),
        (lambda: NaturalFrequencies(frequency=[1, 2], mode=[1, 2, 3]), "of the 2 modes"),
        (lambda: NaturalFrequencies(frequency=[1, 2], sigma=[1]), "must be a list of 2 numbers"),
        (lambda: NaturalFrequencies(frequency=[1, 2], sigma=[1, 0]), "greater than 0 for each"),
        (lambda: NaturalFrequencies(frequency=[1, 2], sigma=-1), "sigma = -1: must be greater"),
        (lambda: NaturalFrequencies(frequency=[1], shapes=[1]), "give ModeShapes"),
        (
            lambda: NaturalFrequencies(
                frequency=[1, 2], shapes=ModeShapes(nodes=[0], values=np.ones((1, 1, 3)))
            ),
            "has the modes [1], but there are values of [1, 2]",
        ),
        (lambda: DampingRatios(damping_ratio=[2.0]), "damping_ratio = 2: must be from 0 to below"),
        (lambda: ModeShapes(nodes=[0], values=np.ones((1, 1, 2))), "here (modes, nodes, 3)"),
        (lambda: ModeShapes(nodes=[0], values=1j * np.ones((1, 1, 3))), "must be real numbers"),
        (lambda: ModeShapes(nodes=[0], values=[[[1.0, np.nan, np.nan]]]), "has 1 components"),
        (lambda: ModeShapes(nodes=[0], values=np.zeros((1, 1, 3))), "not all of them 0"),
        (lambda: ModeShapes(nodes=[0], values=[[[np.inf, 1, 1]]]), "infinite; give NaN"),
        (lambda: ModeShapes(nodes=[0], values=[[[1, 2], [1]]]), "rows have different lengths"),
        (lambda: ModeShapes(nodes=[0], values=np.ones((1, 1, 1)), axes="w"), 'letters of "xyz"'),
        (lambda: curve(values=[1.0, 2.0]), "must be complex numbers (for magnitudes: magnitude"),
        (lambda: curve(magnitude=True), "magnitudes are real numbers (leave out magnitude)"),
        (lambda: curve(values=[-1.0, 2.0], magnitude=True), "a magnitude cannot be negative"),
        (lambda: curve(frequency=[2.0, 1.0]), "must increase from 0 Hz or more"),
        (lambda: curve(frequency=[-1.0, 1.0]), "must increase from 0 Hz or more"),
        (lambda: curve(sigma=[1.0, -1.0]), "must be a number greater than 0 for each"),
        (lambda: curve(sigma=["a", "b"]), "must be a number greater than 0 for each"),
        (lambda: curve(quantity="inertance"), 'quantity = "inertance": did you mean'),
        (lambda: curve(axis="w"), 'axis = "w": choose one of'),
    ],
)  # fmt: skip
def test_data_that_no_test_gives(make, message) -> None:
    with refused(message):
        make()


def curve(**changes) -> FrequencyResponse:
    given = {"nodes": [8], "frequency": [1.0, 2.0], "values": [1.0 + 1j, 2.0], "axis": "z"}
    return FrequencyResponse(**{**given, **changes})


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (NaturalFrequencies(frequency=[1], mode=[31]), "has only 30 that something resists; leave"),
        (ModeShapes(nodes=[99], values=np.ones((1, 1, 3))), "node 99 is out of range"),
        (ModeShapes(nodes=[0, 1], values=np.ones((1, 2, 3))), "supports hold all of them along x"),
        (ModeShapes(nodes=[7, 8], values=np.ones((1, 1, 3))), "has 1 nodes, but 2 are named"),
        (
            ModeShapes(nodes=FREE, values=np.resize([1, -1, 2, 0.3, -2], (1, 6, 3))),
            "mode 1 resembles no mode of the model: the largest MAC",
        ),
        (curve(), 'kind = "frf" needs a case of kind "frf"'),
    ],
)
def test_modes_that_the_model_does_not_have(folder, data, message) -> None:
    with refused(message):
        problem(folder / "modes.toml", [data], [RATIO], {})


def test_shapes_that_cannot_be_told_apart(folder) -> None:
    """At the vertices of a fold its first, third and fourth mode move alike."""
    found = fd.read_case(folder / "fold.toml").run()
    seen = found["shape"].values[[0], :6]
    one = ModeShapes(nodes=range(6), values=seen)
    with pytest.raises(InputError, match=r"mode 1 may be mode 1 of the model .* MAC 1\.00\) or"):
        problem(folder / "fold.toml", [one], [RATIO], {})
    by_place = NaturalFrequencies(frequency=found["frequency"].values[:2])
    problem(folder / "fold.toml", [by_place], [RATIO], {})
    alike = NaturalFrequencies(frequency=[0.447], shapes=one)
    with pytest.raises(InputError, match="measure at more nodes or axes"):
        problem(folder / "fold.toml", [alike], [RATIO], {})


@pytest.mark.parametrize(
    ("old", "new", "changes", "message"),
    [
        ("", "", {"nodes": [0]}, "a support holds node 0 along z"),
        ("", "", {"quantity": "transmissibility"}, "driven by forces, which gives receptance"),
        ("", "", {"nodes": [99]}, "node 99 is out of range"),
        ('kind = "frf"', 'kind = "frf"\nmethod = "impulse"', {}, "fit with one of direct, modal"),
    ],
)
def test_responses_that_the_model_does_not_have(tmp_path, old, new, changes, message) -> None:
    path = fit_cases.write(tmp_path, FRF.replace(old, new) if old else FRF)
    with refused(message):
        problem(path, [curve(**changes)], [ALPHA], {})


def test_kept_evaluations_are_of_the_same_shapes(folder, modes) -> None:
    """Shapes decide which mode a frequency belongs to, so that predictions depend on them."""
    path, seen = folder / "modes.toml", modes["frequency"].values[:2]
    digests = {
        problem(path, [one], [RATIO], {}).digest()
        for one in (
            NaturalFrequencies(frequency=seen, shapes=shapes(modes, (0, 1))),
            NaturalFrequencies(frequency=seen, shapes=shapes(modes, (0, 2))),
            NaturalFrequencies(frequency=seen),
        )
    }
    assert len(digests) == 3
