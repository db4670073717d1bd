"""The experiment: camera tracking, synthetic films to plan and to test it, and calibration.

OpenCV is an optional dependency (``pip install foldyn[experiment]``), imported when it is used.
"""

from __future__ import annotations

from foldyn.facade import lazy

__getattr__, __dir__, __all__ = lazy(__name__, __file__)
