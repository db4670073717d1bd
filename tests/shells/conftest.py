"""Patterns whose meshes the tests of shells look at."""

from __future__ import annotations

import pytest
from test_shell_mesh import FLAT_PANELS, PATTERNS


@pytest.fixture(params=sorted(PATTERNS))
def pattern(request):
    return PATTERNS[request.param]()


@pytest.fixture(params=sorted(FLAT_PANELS))
def flat(request):
    return FLAT_PANELS[request.param]()
