"""Foldyn: statics and dynamics of origami structures.

It turns a crease pattern into a validated motion. Panels become bars and hinges with the stiffness
of MERLIN2 and a choice of mass rules, and M x'' + C x' + F_int(x) = p(t) is integrated.

>>> import foldyn as fd
>>> pattern = fd.patterns.miura(cells=(1, 1), a=1.0, b=1.0, panel_angle=60, dihedral=60)
>>> len(pattern.vertices), len(pattern.faces)
(9, 4)
"""

from __future__ import annotations

from foldyn.facade import lazy

__version__ = "0.1.0"

__getattr__, __dir__, __all__ = lazy(__name__, __file__, "__version__")
