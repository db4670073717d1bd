"""Small vibrations about an equilibrium: modes and frequency response."""

from foldyn.linear.absorbing_ends import LongWaves, absorbing_end, long_waves
from foldyn.linear.band_structure import band_gaps, bands, damped_bands
from foldyn.linear.buckling import buckling
from foldyn.linear.cell_equilibrium import relaxed
from foldyn.linear.cell_motions import space_time, transmission, wave_spectrum
from foldyn.linear.character import character
from foldyn.linear.compared import ComparedMode, Fidelity
from foldyn.linear.effective import effective
from foldyn.linear.evanescent import attenuation
from foldyn.linear.fidelity import fidelity
from foldyn.linear.frequency_domain import Modal
from foldyn.linear.frf import METHODS, convert, frf
from foldyn.linear.harmonic import HarmonicBalance
from foldyn.linear.linearized import Linearized, equivalent_slope, linearize
from foldyn.linear.mac import Pairs, mac, pair_modes
from foldyn.linear.margins import margins
from foldyn.linear.modes import modes
from foldyn.linear.peaks_of import Peak, peaks_of
from foldyn.linear.random_response import random_response
from foldyn.linear.reference import Refinement, refinement
from foldyn.linear.spectral_density import SpectralDensity
from foldyn.linear.spectrum_response import spectrum_response
from foldyn.linear.stresses import stresses
from foldyn.linear.time_domain import SteppedSine
from foldyn.linear.transients import BurstRandom, Impulse
from foldyn.linear.unit_cell import UnitCell

__all__ = [
    "METHODS",
    "BurstRandom",
    "ComparedMode",
    "Fidelity",
    "HarmonicBalance",
    "Impulse",
    "Linearized",
    "LongWaves",
    "Modal",
    "Pairs",
    "Peak",
    "Refinement",
    "SpectralDensity",
    "SteppedSine",
    "UnitCell",
    "absorbing_end",
    "attenuation",
    "band_gaps",
    "bands",
    "buckling",
    "character",
    "convert",
    "damped_bands",
    "effective",
    "equivalent_slope",
    "fidelity",
    "frf",
    "linearize",
    "long_waves",
    "mac",
    "margins",
    "modes",
    "pair_modes",
    "peaks_of",
    "random_response",
    "refinement",
    "relaxed",
    "space_time",
    "spectrum_response",
    "stresses",
    "transmission",
    "wave_spectrum",
]
