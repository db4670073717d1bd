"""Fixtures for all tests."""

from __future__ import annotations

import os
import re
import signal
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings

from browsers import browser  # noqa: F401 - a fixture
from case_fixtures import kept, read  # noqa: F401 - fixtures
from foldyn.linear import model_error
from pairwise import FEW

PANELS = model_error.PANELS
REPOSITORY = Path(__file__).resolve().parents[1]

# no doctests in them, and pytest cannot collect several modules of one name
collect_ignore_glob = ["conftest.py", "*/conftest.py"]

# before anything imports them: figures need no screen, and the oracle needs no accelerator
os.environ.setdefault("MPLBACKEND", "Agg")
os.environ.setdefault("JAX_PLATFORMS", "cpu")
os.environ.setdefault("JAX_ENABLE_X64", "1")

# an example may take its time on a busy machine; where few draws are asked for, fewer examples
settings.register_profile("foldyn", deadline=None, max_examples=25 if FEW else 100)
settings.load_profile("foldyn")

# a job in the background ignores Ctrl-C, and so would every process that tests start
signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def shared() -> Path:
    """Folder of reference data beside the repository; tests that need it skip without it."""
    folder = REPOSITORY.parent / "shared"
    if not folder.is_dir():
        pytest.skip("needs ../shared")
    return folder


@pytest.fixture(scope="session", autouse=True)
def uncompared() -> Iterator[None]:
    """Bars and hinges are not compared with superelements, which takes half a second each time."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(model_error, "PANELS", -1)
        yield


@pytest.fixture
def compared(monkeypatch) -> None:
    """Bars and hinges are compared with superelements, as by default."""
    monkeypatch.setattr(model_error, "PANELS", PANELS)


def pytest_terminal_summary(terminalreporter) -> None:
    """Say what would run the tests that were skipped for lack of it."""
    reasons = [report.longrepr[2] for report in terminalreporter.stats.get("skipped", ())]
    found = [re.search(r"needs (.+)|could not import '(\w+)", reason) for reason in reasons]
    lacking = Counter(one[1] or one[2] for one in found if one)
    if lacking:
        told = ", ".join(f"{name} ({count})" for name, count in lacking.most_common())
        terminalreporter.write_line(f"{lacking.total()} tests skipped for lack of {told}")
