"""Key paths, ties and parameters of a fit."""

from __future__ import annotations

import numpy as np
import pytest
from fit_cases import refused

from foldyn.analyses.keys import Tie, parts, replaced, value_at
from foldyn.errors import InputError
from foldyn.experiment import Parameter
from foldyn.experiment.calibration.parameters import space

DOCUMENT = {
    "sheet": {"thickness": 0.01, "length_scale_ratio": 2.0},
    "model": {"fold_law": {"kind": "enhanced", "theta1": 45}, "bend_law": "enhanced"},
    "loads": [{"force": [0.0, 0.0, 1e-3]}],
}


def test_paths_name_tables_and_lists() -> None:
    assert parts("loads[0].force[2]") == ("loads", 0, "force", 2)
    assert value_at(DOCUMENT, "loads[0].force[2]") == 1e-3
    assert value_at(DOCUMENT, "loads[1].force") is None
    assert value_at(DOCUMENT, "sheet.density") is None


def test_replacing_leaves_the_original_alone() -> None:
    changed = replaced(DOCUMENT, {"loads[0].force[2]": 2.0, "damping.alpha": 0.5})
    assert changed["loads"] == [{"force": [0.0, 0.0, 2.0]}]
    assert changed["damping"] == {"alpha": 0.5}
    assert DOCUMENT["loads"] == [{"force": [0.0, 0.0, 1e-3]}]
    assert "damping" not in DOCUMENT


def test_a_law_by_its_name_becomes_a_table() -> None:
    changed = replaced(DOCUMENT, {"model.bend_law.theta1": 60.0})
    assert changed["model"]["bend_law"] == {"kind": "enhanced", "theta1": 60.0}


@pytest.mark.parametrize(
    ("key", "message"),
    [
        ("sheet thickness", "is no key of a case file"),
        ("loads[1].force", "loads[1].force: there are only 1 entries, [0] to [0]"),
        ("sheet.thickness.top", ".top needs a table, but there is 0.01"),
        ("sheet[0]", "[0] needs a list, but there is { thickness"),
    ],
)
def test_paths_that_lead_nowhere(key, message) -> None:
    with refused(message):
        replaced(DOCUMENT, {key: 1.0})


def test_ties_are_arithmetic_on_keys() -> None:
    known = {"model.fold_law.theta1": 75.0, "loads[0].force[2]": 2.0}
    assert Tie("model.fold_law.theta2", "360 - model.fold_law.theta1").value(known) == 285.0
    assert Tie("a.b", "-(1 + loads[0].force[2]) * 4 / 3").value(known) == -4.0


@pytest.mark.parametrize(
    ("expression", "message"),
    [
        ("360 -", "cannot be read"),
        ("__import__('os').getcwd()", "is neither a number nor a key"),
        ("2 ** 3", "2 ** 3 is neither a number nor a key"),
        ("1 / 0", "divides by zero"),
        ("x" + ".a" * 480, "has more than 50 nested operations"),
        ("1" * 1001, "is longer than 1000 characters"),
        ("2 * 0x" + "f" * 900, "is not a finite number"),
        (360, "= 360: must be a text"),
    ],
)
def test_ties_that_cannot_be_read(expression, message) -> None:
    with pytest.raises(InputError, match=r"tie a\.b = ") as caught:
        Tie("a.b", expression)
    assert message in str(caught.value)


def test_a_key_deeper_than_any_case_file_is_none() -> None:
    for key in ("a" + ".a" * 480, "a[" + "9" * 5000 + "]"):
        with pytest.raises(InputError, match="is no key of a case file"):
            Tie(key, "1")


def test_a_tie_to_what_is_no_parameter() -> None:
    with pytest.raises(InputError, match=r"did you mean .sheet\.thickness."):
        space(DOCUMENT, [Parameter("sheet.thickness")], {"sheet.density": "2 * sheet.thicknes"})


def test_starts_and_scales_come_from_the_case() -> None:
    found = space(
        DOCUMENT, [Parameter("sheet.thickness"), Parameter("damping.beta", 0.0, 0, 2)], {}
    )
    assert found.column("guess").tolist() == [0.01, 0.0]
    assert found.column("scale").tolist() == [0.01, 2.0]


def test_random_starts_fill_the_bounds_and_are_the_same_again() -> None:
    found = space(DOCUMENT, [Parameter("sheet.thickness", 0.01, 0.005, 0.05),
                             Parameter("sheet.length_scale_ratio", 2.0, 1.0, 5.0)], {})  # fmt: skip
    starts = found.guesses(9, seed=3)
    assert starts[0].tolist() == [0.01, 2.0]
    pieces = np.floor((starts[1:] - [0.005, 1.0]) / [0.045, 4.0] * 8)
    for column in pieces.T:
        assert sorted(column) == list(range(8))
    np.testing.assert_array_equal(starts, found.guesses(9, seed=3))
    assert not np.array_equal(starts, found.guesses(9, seed=4))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("sheet.thickness", 0.01, 0.5, 0.2), "lower = 0.5 is not below upper = 0.2"),
        (("sheet.thickness", 1.0, 0.0, 0.5), "guess = 1 is outside the bounds 0 to 0.5"),
        (("sheet.thickness", 1.0, 0.0, 2.0, 0.0), "scale = 0.0: must be greater than 0"),
    ],
)
def test_parameters_that_make_no_sense(arguments, message) -> None:
    with refused(f"sheet.thickness: {message}"):
        Parameter(*arguments)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ([], "parameters: none"),
        (["sheet.thickness"], "parameters[0]: got"),
        ([Parameter("sheet.thicknes")], "did you mean 'sheet.thickness'"),
        ([Parameter("model.bend_law")], 'model.bend_law = "enhanced": is not a number'),
        ([Parameter("damping.beta", 0.0)], "damping.beta: begins from 0; give scale"),
        ([Parameter("sheet.thickness")] * 2, "sheet.thickness: is given twice"),
    ],
)
def test_parameters_that_do_not_fit_the_case(parameters, message) -> None:
    with refused(message):
        space(DOCUMENT, parameters, {})


def test_random_starts_need_bounds() -> None:
    with pytest.raises(InputError, match=r"give sheet\.thickness both lower and upper"):
        space(DOCUMENT, [Parameter("sheet.thickness")], {}).guesses(2, 0)
