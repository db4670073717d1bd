# Public names and where they live; loaded with the package (facade.py)

from foldyn.linear.absorbing_ends import (
    LongWaves as LongWaves,
    absorbing_end as absorbing_end,
    long_waves as long_waves,
)
from foldyn.linear.band_structure import (
    band_gaps as band_gaps,
    bands as bands,
    damped_bands as damped_bands,
)
from foldyn.linear.buckling import buckling as buckling
from foldyn.linear.cell_equilibrium import relaxed as relaxed
from foldyn.linear.cell_motions import (
    space_time as space_time,
    transmission as transmission,
    wave_spectrum as wave_spectrum,
)
from foldyn.linear.character import character as character
from foldyn.linear.compared import ComparedMode as ComparedMode, Fidelity as Fidelity
from foldyn.linear.effective import effective as effective
from foldyn.linear.evanescent import attenuation as attenuation
from foldyn.linear.fidelity import fidelity as fidelity
from foldyn.linear.frequency_domain import Modal as Modal
from foldyn.linear.frf import METHODS as METHODS, convert as convert, frf as frf
from foldyn.linear.harmonic import HarmonicBalance as HarmonicBalance
from foldyn.linear.linearized import (
    Linearized as Linearized,
    equivalent_slope as equivalent_slope,
    linearize as linearize,
)
from foldyn.linear.mac import Pairs as Pairs, mac as mac, pair_modes as pair_modes
from foldyn.linear.margins import margins as margins
from foldyn.linear.modes import modes as modes
from foldyn.linear.peaks_of import Peak as Peak, peaks_of as peaks_of
from foldyn.linear.random_response import random_response as random_response
from foldyn.linear.reference import Refinement as Refinement, refinement as refinement
from foldyn.linear.spectral_density import SpectralDensity as SpectralDensity
from foldyn.linear.spectrum_response import spectrum_response as spectrum_response
from foldyn.linear.stresses import stresses as stresses
from foldyn.linear.time_domain import SteppedSine as SteppedSine
from foldyn.linear.transients import BurstRandom as BurstRandom, Impulse as Impulse
from foldyn.linear.unit_cell import UnitCell as UnitCell
