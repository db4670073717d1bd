"""Registry of the generators."""

from __future__ import annotations

from collections.abc import Callable

from foldyn.patterns.generators.arc_miura import arc_miura
from foldyn.patterns.generators.curved_pleat import curved_pleat
from foldyn.patterns.generators.eggbox import eggbox
from foldyn.patterns.generators.flasher import flasher
from foldyn.patterns.generators.kresling import kresling
from foldyn.patterns.generators.miura import miura
from foldyn.patterns.generators.miura_tube import miura_tube, zipper_tubes
from foldyn.patterns.generators.resch import resch
from foldyn.patterns.generators.simple_fold import simple_fold
from foldyn.patterns.generators.square_twist import square_twist
from foldyn.patterns.generators.waterbomb import waterbomb
from foldyn.patterns.generators.yoshimura import yoshimura
from foldyn.patterns.pattern import Pattern

GENERATORS: dict[str, Callable[..., Pattern]] = {
    generator.__name__: generator
    for generator in (
        simple_fold,
        miura,
        arc_miura,
        eggbox,
        kresling,
        waterbomb,
        yoshimura,
        curved_pleat,
        miura_tube,
        zipper_tubes,
        resch,
        square_twist,
        flasher,
    )
}
"""Generators, by their names in case files (`[pattern] kind`)."""
