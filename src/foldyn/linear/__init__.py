"""Small vibrations about an equilibrium: modes and frequency response."""

from foldyn.linear.burst_random import BurstRandom
from foldyn.linear.character import character
from foldyn.linear.frf import METHODS, frf
from foldyn.linear.harmonic import HarmonicBalance
from foldyn.linear.impulse import Impulse
from foldyn.linear.linearized import Linearized, linearize
from foldyn.linear.mac import Pairs, mac, pair_modes
from foldyn.linear.modal import Modal
from foldyn.linear.modes import modes
from foldyn.linear.peaks_of import Peak, peaks_of
from foldyn.linear.quantity import convert
from foldyn.linear.refinement import Refinement, refinement
from foldyn.linear.secant import equivalent_slope
from foldyn.linear.stepped_sine import SteppedSine

__all__ = [
    "METHODS",
    "BurstRandom",
    "HarmonicBalance",
    "Impulse",
    "Linearized",
    "Modal",
    "Pairs",
    "Peak",
    "Refinement",
    "SteppedSine",
    "character",
    "convert",
    "equivalent_slope",
    "frf",
    "linearize",
    "mac",
    "modes",
    "pair_modes",
    "peaks_of",
    "refinement",
]
