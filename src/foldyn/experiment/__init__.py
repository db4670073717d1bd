"""The experiment: camera tracking, synthetic films for planning and tests, and calibration.

OpenCV is an optional dependency (``pip install foldyn[experiment]``), imported on first use.
"""

from __future__ import annotations

from foldyn.facade import lazy

__getattr__, __dir__, __all__ = lazy(__name__, __file__)
