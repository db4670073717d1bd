"""Named models: sets of options of `discretize`.

A preset supplies the options that are not given. The default is "n5b8e", unless a given option
implies another: another scheme, the calibration "plate" or a bend law "plate", and so do
superlinear folds, whose small vibrations "n5b8e" refuses; another calibration, or superlinear bends
without a calibration, "herkal". A bar law other than "linear" implies independent bars.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from foldyn.errors import InputError
from foldyn.materials import EnhancedLinear, PlateSuperlinear, Superlinear, bar_law, hinge_law
from foldyn.structures.fold_law import laws_given
from foldyn.structures.mass import MASS_RULES
from foldyn.structures.structure import MEMBRANES, ModelOptions
from foldyn.values import choice, show

PLATE, N5B8E, HERKAL, MERLIN2 = "plate", "n5b8e", "herkal", "merlin2"
OF_HINGES = {"scheme", "calibration", "bend_law"}
"""Options of hinges in panels."""

PRESETS: Mapping[str, ModelOptions] = {
    N5B8E: ModelOptions(scheme="n5b8e", mass="condensed", membrane="panel", bar_law="linear"),
    PLATE: ModelOptions(membrane="panel", bar_law="linear"),
    HERKAL: ModelOptions(mass="mixed_voronoi", bend_law="superlinear", calibration="standard"),
    MERLIN2: ModelOptions(
        mass="mixed_voronoi", bend_law="superlinear", calibration="merlin2",
        fold_law=EnhancedLinear(rest="as_published"),
    ),
}  # fmt: skip
"""Options by name of the preset.

- "n5b8e": panels bend and twist as thin plates that give way at their creases, and have a thin
  plate's membrane stiffness at their corners; the closest to the shell (docs/fidelity.md);
- "plate": the same, but panels do not give way at their creases: the fast choice;
- "herkal": the model of Herkal et al., Int. J. Solids Struct. 309, 2025;
- "merlin2": MERLIN2 as published (Liu and Paulino, 2018), with its order of stiffnesses and with
  moments at rest; it has no mass rule, so that it gets the rule of "herkal".
"""


def resolved(preset: str | None = None, **given: Any) -> ModelOptions:
    """All options of a model.

    Parameters
    ----------
    preset : {"n5b8e", "plate", "herkal", "merlin2"}, optional
        The module docstring describes the default.
    **given
        Fields of `ModelOptions` that override the preset, unless they are None.

    Raises
    ------
    InputError
        An option is unknown, or two options are incompatible.
    """
    known = {name: value for name, value in given.items() if value is not None}
    name = implied(known) if preset is None else choice("preset", preset, PRESETS)
    base = PRESETS[name]
    law = known.get("bar_law")
    if law is not None and bar_law(law) != bar_law("linear"):
        known.setdefault("membrane", "bars")
    if "membrane" in known:
        coupled = choice("membrane", known["membrane"], MEMBRANES) == "panel"
        known.setdefault("bar_law", "linear" if coupled else "ogden")
    known["fold_law"], _ = laws_given(known.get("fold_law", base.fold_law), base.fold_law)
    options = ModelOptions(**{**vars(base), **known})
    choice("mass", options.mass, MASS_RULES)
    bar_law(options.bar_law)
    if options.membrane == "panel" and bar_law(options.bar_law) != bar_law("linear"):
        raise InputError(
            f" = {show(options.bar_law)}: bars that are coupled are linear in Green strain; leave "
            'it out, or take membrane = "bars"',
            "bar_law",
        )
    _check_bends(options)
    _check_edges(options)
    return options


def implied(given: Mapping[str, Any]) -> str:
    """Name of the preset that the given options imply."""
    _, folds = laws_given(given.get("fold_law", "linear"))
    soft = any(isinstance(law, Superlinear) for law in folds)
    plain = not OF_HINGES & {*given} and not soft
    if plain or given.get("scheme") == N5B8E:
        return N5B8E
    if "calibration" in given:
        return PLATE if given["calibration"] == "plate" else HERKAL
    bends = hinge_law(given.get("bend_law", "linear"), "bend_law")
    return HERKAL if isinstance(bends, Superlinear) else PLATE


def _check_bends(options: ModelOptions) -> None:
    """Refuse bend laws that are incompatible with the stiffness from the calibration."""
    bends = hinge_law(options.bend_law, "bend_law")
    of_plates = options.calibration == "plate"
    if isinstance(bends, PlateSuperlinear) and bends.onset is None and not of_plates:
        raise InputError(
            ' = "plate_superlinear": has a plate\'s stiffness for small turns, which only '
            'calibration = "plate" gives to bends; set it, or give PlateSuperlinear(onset=...)',
            "bend_law",
        )
    if isinstance(bends, Superlinear) and of_plates:
        raise InputError(
            ' = "superlinear": needs the stiffness of large turns, but calibration = "plate" gives '
            'the stiffness of small ones; take "linear" or "plate_superlinear", or preset = '
            '"herkal"',
            "bend_law",
        )


def _check_edges(options: ModelOptions) -> None:
    """Refuse options that are incompatible with the scheme n5b8e, and edges that cannot bow."""
    if options.scheme != N5B8E:
        for name in ("straight", "guided") if not options.bowed else ():
            if getattr(options, name):
                raise InputError(
                    ': edges bow with scheme = "n5b8e" or membrane = "panel" only: leave it out',
                    name,
                )
        return
    needs = 'scheme = "n5b8e" needs'
    if options.calibration != "plate":
        raise InputError(
            f' = "{options.calibration}": {needs} "plate", whose panels are plates', "calibration"
        )
    if hinge_law(options.bend_law, "bend_law") != hinge_law("linear"):
        raise InputError(
            f' = {show(options.bend_law)}: {needs} "linear", as its panels bend', "bend_law"
        )
