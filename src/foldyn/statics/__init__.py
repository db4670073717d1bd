"""Statics: equilibrium paths, their stability and branches, and energy landscapes."""

from foldyn.algebra.solvers import SOLVERS
from foldyn.statics.branch import switch_branch
from foldyn.statics.energy_landscape import Equilibrium, Landscape, landscape
from foldyn.statics.equilibrium import OrigamiProblem
from foldyn.statics.folding import Folding, fold
from foldyn.statics.mechanism import mechanisms
from foldyn.statics.newton import Settings, Solver
from foldyn.statics.path_methods import METHODS
from foldyn.statics.problem import Problem
from foldyn.statics.stepping import Point
from foldyn.statics.tracing import trace

__all__ = [
    "METHODS",
    "SOLVERS",
    "Equilibrium",
    "Folding",
    "Landscape",
    "OrigamiProblem",
    "Point",
    "Problem",
    "Settings",
    "Solver",
    "fold",
    "landscape",
    "mechanisms",
    "switch_branch",
    "trace",
]
