# Public names and where they live; loaded when they are first used (facade.py)

from foldyn.patterns.boards import Boards as Boards
from foldyn.patterns.facets import convex as convex, welded as welded
from foldyn.patterns.flat_foldability import (
    FlatFoldability as FlatFoldability,
    flat_foldable as flat_foldable,
)
from foldyn.patterns.generators.arc_miura import arc_miura as arc_miura
from foldyn.patterns.generators.curved_pleat import curved_pleat as curved_pleat
from foldyn.patterns.generators.eggbox import eggbox as eggbox
from foldyn.patterns.generators.flasher import flasher as flasher
from foldyn.patterns.generators.kresling import kresling as kresling
from foldyn.patterns.generators.miura import miura as miura
from foldyn.patterns.generators.miura_tube import (
    miura_tube as miura_tube,
    zipper_tubes as zipper_tubes,
)
from foldyn.patterns.generators.registry import GENERATORS as GENERATORS
from foldyn.patterns.generators.resch import resch as resch
from foldyn.patterns.generators.simple_fold import simple_fold as simple_fold
from foldyn.patterns.generators.square_twist import square_twist as square_twist
from foldyn.patterns.generators.waterbomb import waterbomb as waterbomb
from foldyn.patterns.generators.yoshimura import yoshimura as yoshimura
from foldyn.patterns.imperfection import imperfect as imperfect
from foldyn.patterns.pattern import Pattern as Pattern
from foldyn.patterns.screw import Screw as Screw
from foldyn.patterns.selection import select as select
from foldyn.patterns.thick import thicken as thicken
