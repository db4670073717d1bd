"""Units of length that pattern files name."""

from __future__ import annotations

METERS = {
    "m": 1.0,
    "cm": 1e-2,
    "mm": 1e-3,
    "um": 1e-6,
    "nm": 1e-9,
    "km": 1e3,
    "in": 0.0254,
    "ft": 0.3048,
    "pt": 0.0254 / 72,
    "px": 0.0254 / 96,
}
"""Lengths (m)."""
