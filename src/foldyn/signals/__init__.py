"""Signals: analysis of measured or computed records, given as arrays; independent of origami."""

from __future__ import annotations

from foldyn.signals.circle_fit import CircleFit, circle_fit, circle_fits
from foldyn.signals.frequency_response import (
    FrequencyResponse,
    base_transmissibility,
    convert_response,
    exponential_window,
    frequency_response,
    transmissibility,
    without_window,
)
from foldyn.signals.log_decrement import LogDecrement, log_decrement
from foldyn.signals.matrix_pencil import DecayingModes, matrix_pencil
from foldyn.signals.peaks import HalfPower, Peaks, find_peaks, half_power
from foldyn.signals.preprocessing import (
    choose_window,
    fill_gaps,
    first_turning_point,
    remove_trend,
    subtract_final,
)
from foldyn.signals.records import is_uniform, sampling_interval
from foldyn.signals.shock_spectrum import ShockSpectrum, shock_spectrum
from foldyn.signals.spectrum import spectrum
from foldyn.signals.stepped_sine import SineFit, fit_sine, stepped_sine
from foldyn.signals.wave_field import Pulse, WavenumberSpectrum, pulse, wavenumber_spectrum

__all__ = [
    "CircleFit",
    "DecayingModes",
    "FrequencyResponse",
    "HalfPower",
    "LogDecrement",
    "Peaks",
    "Pulse",
    "ShockSpectrum",
    "SineFit",
    "WavenumberSpectrum",
    "base_transmissibility",
    "choose_window",
    "circle_fit",
    "circle_fits",
    "convert_response",
    "exponential_window",
    "fill_gaps",
    "find_peaks",
    "first_turning_point",
    "fit_sine",
    "frequency_response",
    "half_power",
    "is_uniform",
    "log_decrement",
    "matrix_pencil",
    "pulse",
    "remove_trend",
    "sampling_interval",
    "shock_spectrum",
    "spectrum",
    "stepped_sine",
    "subtract_final",
    "transmissibility",
    "wavenumber_spectrum",
    "without_window",
]
