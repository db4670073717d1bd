"""What the tests of cases share."""

from __future__ import annotations

import pytest
from attached_cases import MODELS

from case_fixtures import kept, read  # noqa: F401 - fixtures


@pytest.fixture(params=MODELS)
def model(request):
    return request.param
