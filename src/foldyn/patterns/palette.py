"""Colors of pictures, and of the creases in pictures; independent of Matplotlib."""

from __future__ import annotations

# Okabe and Ito's palette, distinguishable with every common kind of color blindness.
BLUE = "#0072B2"
VERMILLION = "#D55E00"
GREEN = "#009E73"
PURPLE = "#CC79A7"
SKY = "#56B4E9"
ORANGE = "#E69F00"
YELLOW = "#F0E442"
BLACK = "#1A1A1A"
GRAY = "#767676"
LIGHT = "#C8C8C8"
PAPER = "#F2DFB8"

CREASES = {"M": VERMILLION, "V": BLUE, "F": GRAY, "U": PURPLE}
CREASE_NAMES = {"M": "mountain", "V": "valley", "F": "flat", "U": "unassigned"}
