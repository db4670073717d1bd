"""Sweeps on a Dask cluster of this machine; skipped where Dask is not installed."""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path

import numpy as np
import pytest
from swept_cases import MODES, slow_measure

import foldyn as fd
from foldyn.errors import InputError

VARY = {"sheet.thickness": np.linspace(0.005, 0.02, 24)}
HERE = str(Path(__file__).parent)


@pytest.fixture
def sweep(tmp_path):
    """Function that sweeps a case file."""
    (tmp_path / "case.toml").write_text(MODES)

    def swept(measures=("frequencies",), **how):
        return fd.sweep(tmp_path / "case.toml", VARY, measures=list(measures), **how)

    return swept


def test_without_dask_the_message_says_what_to_install(sweep, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r"pip install foldyn\[dask\]"):
        sweep(scheduler="tcp://127.0.0.1:1")


@pytest.fixture
def cluster(monkeypatch):
    """Two processes of one thread each, which find the modules of the tests."""
    dask = pytest.importorskip("distributed")
    paths = os.pathsep.join([HERE, str(Path(HERE).parent), os.environ.get("PYTHONPATH", "")])
    monkeypatch.setenv("PYTHONPATH", paths)
    with dask.LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=None, processes=True
    ) as made:
        yield made


@pytest.mark.matrix
def test_a_worker_that_is_killed_loses_nothing(tmp_path, sweep, cluster):
    killed: list[int] = []

    def kill(course) -> None:
        if course.done == 8 and not killed:
            workers = cluster.scheduler_info["workers"].values()
            pids = [nanny.process.pid for nanny in cluster.workers.values()]
            assert len(workers) == 2
            os.kill(pids[0], signal.SIGKILL)
            killed.append(pids[0])

    where = {"scheduler": cluster.scheduler_address, "folder": tmp_path / "points"}
    found = sweep(["frequencies", slow_measure], **where, progress=kill)
    assert killed
    alone = sweep(processes=1)
    assert found.attrs["failed"] == 0
    np.testing.assert_array_equal(found["frequencies"], alone["frequencies"])
    np.testing.assert_array_equal(found["slow_measure"], alone["frequencies"][:, 0])
    assert len(list((tmp_path / "points").iterdir())) == 24


@pytest.mark.matrix
def test_a_scheduler_that_is_not_there_is_told(sweep):
    pytest.importorskip("distributed")
    with pytest.raises(InputError, match=r"scheduler = tcp://127\.0\.0\.1:1: no Dask scheduler"):
        sweep(scheduler="tcp://127.0.0.1:1")


@pytest.mark.matrix
def test_workers_of_several_threads_are_refused(sweep):
    dask = pytest.importorskip("distributed")
    with (
        dask.LocalCluster(n_workers=1, threads_per_worker=2, dashboard_address=None) as made,
        pytest.raises(InputError, match="--nthreads 1"),
    ):
        sweep(scheduler=made.scheduler_address)
