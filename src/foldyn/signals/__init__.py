"""Signals: arrays in, arrays out; nothing here knows of origami."""

from __future__ import annotations

from foldyn.signals.sampling import is_uniform, sampling_interval
from foldyn.signals.spectrum import spectrum

__all__ = ["is_uniform", "sampling_interval", "spectrum"]
