"""Functions that compiled ones alone may call."""

from __future__ import annotations

import pytest

from foldyn.jit.compiled import inner, kernel


@inner
def more(x):
    return x + 1


@kernel
def twice_more(x):
    return 2 * more(x)


def test_a_call_from_python_is_refused_before_and_after_it_is_compiled():
    """There is no way in: without the refusal, the second call would end the process."""
    for _ in range(2):
        with pytest.raises(TypeError, match="more is for compiled functions"):
            more(1)
        assert twice_more(1) == 4
