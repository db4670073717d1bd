# Public names and where they live; loaded when they are first used (facade.py)

from foldyn.signals.circles import (
    CircleFit as CircleFit,
    circle_fit as circle_fit,
    circle_fits as circle_fits,
)
from foldyn.signals.decrement import LogDecrement as LogDecrement, log_decrement as log_decrement
from foldyn.signals.peaks import (
    HalfPower as HalfPower,
    Peaks as Peaks,
    find_peaks as find_peaks,
    half_power as half_power,
)
from foldyn.signals.pencil import DecayingModes as DecayingModes, matrix_pencil as matrix_pencil
from foldyn.signals.preprocessing import (
    choose_window as choose_window,
    fill_gaps as fill_gaps,
    first_turning_point as first_turning_point,
    remove_trend as remove_trend,
    subtract_final as subtract_final,
)
from foldyn.signals.records import is_uniform as is_uniform, sampling_interval as sampling_interval
from foldyn.signals.responses import (
    FrequencyResponse as FrequencyResponse,
    base_transmissibility as base_transmissibility,
    convert_response as convert_response,
    exponential_window as exponential_window,
    frequency_response as frequency_response,
    transmissibility as transmissibility,
    without_window as without_window,
)
from foldyn.signals.shocks import ShockSpectrum as ShockSpectrum, shock_spectrum as shock_spectrum
from foldyn.signals.sines import (
    SineFit as SineFit,
    fit_sine as fit_sine,
    stepped_sine as stepped_sine,
)
from foldyn.signals.spectra import spectrum as spectrum
from foldyn.signals.wave_field import (
    Pulse as Pulse,
    WavenumberSpectrum as WavenumberSpectrum,
    pulse as pulse,
    wavenumber_spectrum as wavenumber_spectrum,
)
