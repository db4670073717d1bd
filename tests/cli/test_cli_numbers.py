"""Numbers of the command line: refused at the door like those of files, in a few words."""

from __future__ import annotations

import pytest

from foldyn.cli.main import main

DIGITS = "9" * 5000
WHOLES = (DIGITS, "1" + "0" * 30, str(2**63), "-5", "0")
SIZES = ("1e103", "1e308", "1e-300", "nan", "inf", DIGITS)


def refused(workplace, *arguments: str) -> str:
    """What a call says that is refused; nothing is written."""
    before = workplace.contents()
    try:
        status = main(arguments)
    except SystemExit as stop:  # argparse's own
        status = stop.code
    told = workplace.capsys.readouterr()
    assert (status, told.out) == (2, ""), told
    assert workplace.contents() == before
    assert "Traceback" not in told.err
    assert len(told.err) < 5000
    assert "RuntimeWarning" not in told.err
    return told.err


@pytest.mark.parametrize("number", WHOLES)
def test_counts(workplace, miura, number) -> None:
    workplace.write(miura)
    assert "count" in refused(workplace, "modes", "case.toml", f"--count={number}")
    shell = ("run", "case.toml", "--model", "shell", f"--divisions={number}")
    assert "divisions" in refused(workplace, *shell)
    told = refused(workplace, "frf", "case.toml", "--frequencies", "1", "5", number)
    assert "frequencies" in told


@pytest.mark.parametrize("number", SIZES)
def test_sizes(workplace, miura, number) -> None:
    workplace.write(miura)
    told = refused(workplace, "frf", "case.toml", "--frequencies", "1", number, "5")
    assert "frequencies" in told
    assert "secant" in refused(workplace, "modes", "case.toml", "--secant", number)


def test_divisions_that_memory_does_not_hold(workplace, miura) -> None:
    workplace.write(miura)
    shell = ("run", "case.toml", "--model", "shell", "--divisions=3000")
    for force in ([], ["--force"]):
        told = refused(workplace, *shell, *force)
        assert "model: divisions = 3000: a shell of about 3.6e+07 nodes needs about 671 GiB" in told


FORCES = "displacement [mm],force [mN]\n-100,-8\n-200,-17\n-300,-27\n"


@pytest.mark.parametrize(
    ("option", "numbers"),
    [
        ("--searches", WHOLES),
        ("--processes", WHOLES),
        ("--sigma", SIZES),
        ("--vary=sheet.thickness", tuple(f"{size}" for size in SIZES)),
        ("--vary=sheet.thickness=0.01", tuple(f"{size}:1" for size in SIZES)),
    ],
)
def test_fits(workplace, miura, option, numbers) -> None:
    workplace.write(miura)
    workplace.write(FORCES, "forces.csv")
    vary = () if option.startswith("--vary") else ("--vary=sheet.thickness=0.01:0.001:0.1",)
    joint = ":" if option.count("=") == 2 else "="
    for number in numbers:
        told = refused(workplace, "fit", "case.toml", "forces.csv", *vary, option + joint + number)
        assert told
