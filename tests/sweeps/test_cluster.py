"""Sweeps on a Dask cluster of this machine; skipped where Dask is not installed."""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path

import numpy as np
import pytest
from swept_cases import MODES

import foldyn as fd
from foldyn.errors import InputError, optional

VARY = {"sheet.thickness": np.linspace(0.005, 0.02, 24)}
TRIED = 240.0  # s

HERE = str(Path(__file__).parent)


def test_without_dask_the_message_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    (tmp_path / "case.toml").write_text(MODES)
    with pytest.raises(InputError, match=r"pip install foldyn\[dask\]"):
        fd.sweep(tmp_path / "case.toml", VARY, ["frequencies"], scheduler="tcp://127.0.0.1:1")
    with pytest.raises(InputError):
        optional("distributed", "", "")


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
def test_a_cluster_gives_the_same(tmp_path, cluster):
    (tmp_path / "case.toml").write_text(MODES)
    address = cluster.scheduler_address
    how = {"scheduler": address, "folder": tmp_path / "points"}
    found = fd.sweep(tmp_path / "case.toml", VARY, ["frequencies"], **how)
    alone = fd.sweep(tmp_path / "case.toml", VARY, ["frequencies"], processes=1)
    np.testing.assert_array_equal(found["frequencies"], alone["frequencies"])
    assert len(list((tmp_path / "points").iterdir())) == 24


@pytest.mark.matrix
def test_a_worker_that_is_killed_loses_nothing(tmp_path, cluster):
    from swept_cases import slow_measure

    (tmp_path / "case.toml").write_text(MODES)
    killed: list[int] = []

    def kill(course) -> None:
        if course.done == 8 and not killed:
            workers = cluster.scheduler_info["workers"].values()
            pids = [nanny.process.pid for nanny in cluster.workers.values()]
            assert len(workers) == 2
            os.kill(pids[0], signal.SIGKILL)
            killed.append(pids[0])

    measures = ["frequencies", slow_measure]
    folder = tmp_path / "points"
    found = fd.sweep(
        tmp_path / "case.toml", VARY, measures, scheduler=cluster.scheduler_address,
        folder=folder, progress=kill,
    )  # fmt: skip
    assert killed
    alone = fd.sweep(tmp_path / "case.toml", VARY, ["frequencies"], processes=1)
    assert found.attrs["failed"] == 0
    np.testing.assert_array_equal(found["frequencies"], alone["frequencies"])
    np.testing.assert_array_equal(found["slow_measure"], alone["frequencies"][:, 0])
    assert len(list(folder.iterdir())) == 24


@pytest.mark.matrix
def test_a_scheduler_that_is_not_there_is_told(tmp_path):
    pytest.importorskip("distributed")
    (tmp_path / "case.toml").write_text(MODES)
    with pytest.raises(InputError, match=r"scheduler = tcp://127\.0\.0\.1:1: no Dask scheduler"):
        fd.sweep(tmp_path / "case.toml", VARY, ["frequencies"], scheduler="tcp://127.0.0.1:1")


@pytest.mark.matrix
def test_workers_of_several_threads_are_refused(tmp_path):
    dask = pytest.importorskip("distributed")
    (tmp_path / "case.toml").write_text(MODES)
    with (
        dask.LocalCluster(n_workers=1, threads_per_worker=2, dashboard_address=None) as made,
        pytest.raises(InputError, match="--nthreads 1"),
    ):
        fd.sweep(tmp_path / "case.toml", VARY, ["frequencies"], scheduler=made.scheduler_address)
