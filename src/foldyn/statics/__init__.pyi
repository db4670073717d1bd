from foldyn.algebra.solvers import SOLVERS as SOLVERS
from foldyn.statics.branch import switch_branch as switch_branch
from foldyn.statics.energy_landscape import (
    Equilibrium as Equilibrium,
    Landscape as Landscape,
    landscape as landscape,
)
from foldyn.statics.equilibrium import OrigamiProblem as OrigamiProblem
from foldyn.statics.folding import Folding as Folding, fold as fold
from foldyn.statics.tracing import mechanisms as mechanisms
from foldyn.statics.newton import Problem as Problem, Settings as Settings, Solver as Solver
from foldyn.statics.path_methods import METHODS as METHODS
from foldyn.statics.stepping import Point as Point
from foldyn.statics.tracing import trace as trace

__all__: list[str]
