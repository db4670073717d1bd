"""What the tests of cases share."""

from __future__ import annotations

import pytest
from attached_cases import MODELS


@pytest.fixture(params=MODELS)
def model(request):
    return request.param
