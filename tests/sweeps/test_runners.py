"""Points as processes of their own: on this machine and on a Dask cluster, with equal bits.

             pool                                     cluster
nursery --+-- point -- federates        scheduler --+-- worker -- nursery -- point -- federates
          +-- point -- federates                    +-- worker -- nursery -- point -- federates
"""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tieline.errors import TielineError
from tieline.experiment.launch import launch
from tieline.experiment.load import load_experiment
from tieline.experiment.plan import Plan, prepare
from tieline.experiment.results import read_manifest, read_runs
from tieline.experiment.supervise import child_environment
from tieline.experiment.sweep import Point
from tieline.experiment.sweep_run import InTurn, Listener, run_sweep
from tieline.sweeps.cluster import DaskCluster
from tieline.sweeps.local import LocalPool

EXPERIMENT = """\
# Does a lost packet matter?
name: tiny
question: Does a lost packet matter?
case: miniwecc
grid:
  duration: 0.5 s
  events: [{at: 0.1 s, trip_generator: G26}]
federation: {core: local, hang_timeout: 60 s}
sweep:
"""
LOSSES = (0, 0.1, 0.2, 0.3)


def plan_of(folder: Path, count: int = len(LOSSES)) -> Plan:
    """Return the plan of a sweep over packet loss."""
    path = folder / "tiny.yaml"
    lines = [f"  - {{label: loss {loss}, network.loss: {loss}}}\n" for loss in LOSSES[:count]]
    path.write_text(EXPERIMENT + "".join(lines))
    return prepare(load_experiment(str(path)))


def children(pid: int) -> list[int]:
    """Return the child processes of a process."""
    return [int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def nursery() -> int:
    """Return the process of this test's nursery."""
    (pid,) = [
        pid
        for pid in children(os.getpid())
        if b"tieline.sweeps.nursery" in Path(f"/proc/{pid}/cmdline").read_bytes()
    ]
    return pid


def hashes(folder: Path) -> dict[str, Any]:
    """Return the content hashes of every table of a sweep."""
    return {run.label: run.manifest["tables"] for run in read_runs(folder)}


class Course:
    """Remembers what became of each point, and acts when the first says that it goes on."""

    def __init__(self, act: Any = None) -> None:
        self.ended: dict[str, str] = {}
        self.kept: list[str] = []
        self._act = act

    def listener(self) -> Listener:
        """Return what the sweep talks to."""
        return Listener(self._on_time, self._on_kept, self._on_end)

    def _on_time(self, point: Point, time_s: float) -> None:
        if self._act is not None:
            act, self._act = self._act, None
            act()

    def _on_kept(self, points: Any) -> None:
        self.kept = [point.label for point in points]

    def _on_end(self, point: Point, error: TielineError | None) -> None:
        self.ended[point.label] = "" if error is None else str(error)


class Interrupting(Course):
    """Kills the first point that goes on, and interrupts the sweep when the second has ended."""

    def __init__(self) -> None:
        super().__init__(self._kill)
        self.nursery = 0

    def _kill(self) -> None:
        self.nursery = nursery()
        for pid in children(self.nursery):
            os.kill(pid, signal.SIGKILL)

    def _on_end(self, point: Point, error: TielineError | None) -> None:
        super()._on_end(point, error)
        if len(self.ended) == 2:
            raise KeyboardInterrupt


@pytest.fixture(scope="module")
def broken(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Interrupting]:
    """Return a sweep of which one point was killed, one is complete and two never ran."""
    folder = tmp_path_factory.mktemp("pool")
    course = Interrupting()
    with pytest.raises(KeyboardInterrupt):
        run_sweep(plan_of(folder), folder / "out", LocalPool(1, "local"), course.listener())
    reason = read_manifest(folder / "out")["reason"]
    assert reason == "interrupted from the keyboard"
    return folder, course


@pytest.fixture(scope="module")
def whole(broken: tuple[Path, Interrupting]) -> tuple[Path, Course]:
    """Return the same sweep, resumed with two points at once, and its nursery killed meanwhile."""
    folder, _ = broken
    course = Course(lambda: os.kill(nursery(), signal.SIGKILL))
    run_sweep(plan_of(folder), folder / "out", LocalPool(2, "local"), course.listener())
    return folder / "out", course


def test_the_death_of_one_point_hurts_no_other(broken: tuple[Path, Interrupting]) -> None:
    """Otherwise one crash would end a sweep of hundreds of points."""
    _, course = broken
    assert course.ended == {"loss 0": "its process was killed by SIGKILL", "loss 0.1": ""}


def test_an_interrupt_ends_every_process(broken: tuple[Path, Interrupting]) -> None:
    """Otherwise Ctrl-C would leave simulations behind."""
    _, course = broken
    assert course.nursery
    assert not Path(f"/proc/{course.nursery}").exists()


def test_a_resumed_sweep_runs_only_what_is_missing(whole: tuple[Path, Course]) -> None:
    """Otherwise a crash or Ctrl-C would cost the points that were finished."""
    folder, course = whole
    assert course.kept == ["loss 0.1"]
    assert course.ended == dict.fromkeys(["loss 0", "loss 0.2", "loss 0.3"], "")
    assert read_manifest(folder)["status"] == "complete"
    assert not [path for path in (folder / "points").iterdir() if path.name.startswith(".")]


def test_a_forked_point_has_the_bits_of_a_program_of_its_own(
    whole: tuple[Path, Course], tmp_path: Path
) -> None:
    """Otherwise a result would depend on what its process had simulated before."""
    run_sweep(plan_of(tmp_path, 1), tmp_path / "out", InTurn(launch))
    assert hashes(tmp_path / "out")["loss 0"] == hashes(whole[0])["loss 0"]


class Cluster:
    """A Dask scheduler and two workers as processes, on free ports of the loopback."""

    def __init__(self, folder: Path) -> None:
        self._file = folder / "scheduler.json"
        self._log = (folder / "cluster.log").open("wb")
        here = ["--host", "127.0.0.1", "--no-dashboard", "--scheduler-file", str(self._file)]
        self.processes = [self._start("dask_scheduler", [*here, "--port", "0"])]
        alone = [*here, "--no-nanny", "--nthreads", "1"]
        self.processes += [self._start("dask_worker", alone) for _ in range(2)]

    def address(self) -> str:
        """Return the scheduler's address as soon as it has one."""
        # The file is there before its content is.
        while not (self._file.exists() and self._file.read_text().endswith("}")):
            assert self.processes[0].poll() is None, "the scheduler did not start"
            time.sleep(0.05)
        return str(json.loads(self._file.read_text())["address"])

    def close(self) -> None:
        """End the processes."""
        for process in self.processes:
            process.kill()
            process.wait()
        self._log.close()

    def _start(self, name: str, options: list[str]) -> "subprocess.Popen[bytes]":
        command = [sys.executable, "-m", f"distributed.cli.{name}", *options]
        return subprocess.Popen(
            command, stdout=self._log, stderr=self._log, env=child_environment()
        )


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[Cluster]:
    """Give a cluster of two workers."""
    made = Cluster(tmp_path)
    yield made
    made.close()


@pytest.mark.slow
def test_a_cluster_gives_the_same_tables_though_a_worker_dies(
    cluster: Cluster, whole: tuple[Path, Course], tmp_path: Path
) -> None:
    """Otherwise results would depend on where they were made, or on every node's good health."""

    class Killing(Course):
        def _on_end(self, point: Point, error: TielineError | None) -> None:
            super()._on_end(point, error)
            cluster.processes[-1].kill()

    course = Killing()
    folder = run_sweep(
        plan_of(tmp_path),
        tmp_path / "out",
        DaskCluster(cluster.address(), "local"),
        course.listener(),
    )
    assert course.ended == dict.fromkeys([f"loss {loss}" for loss in LOSSES], "")
    assert hashes(folder) == hashes(whole[0])
    assert (folder / "points.csv").read_bytes() == (whole[0] / "points.csv").read_bytes()
