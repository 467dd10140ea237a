"""Runs points on this machine, as many at once as it has cores for."""

import os
from collections.abc import Generator, Sequence
from pathlib import Path

from tieline.experiment.plan import Plan
from tieline.experiment.point import Task
from tieline.experiment.sweep_run import Ended, OnTime
from tieline.sweeps.client import Done, Events, Nursery

BYTES_A_POINT = 400_000_000
"""Allowed for one point: its processes take some 100 MB each beside what all of them share."""

_ATTEMPTS = 2


def cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def default_jobs(plan: Plan) -> int:
    """Return how many points to run at once: one a core, if memory allows.

    Over zmq or tcp, too: grid and network are then processes of their own, but wait for each other.
    """
    free = available_bytes()
    fitting = cores() if free is None else free // BYTES_A_POINT
    return max(1, min(cores(), len(plan.runs), fitting))


def available_bytes() -> int | None:
    """Return the memory that new processes can have, or None where the kernel does not tell."""
    try:
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
    except OSError:
        return None
    found = [line.split()[1] for line in lines if line.startswith("MemAvailable:")]
    return int(found[0]) * 1024 if found else None


class LocalPool:
    """Runs tasks as processes that a nursery forks, several at once.

    Args:
        jobs: points at once.
        core: of the federations.
    """

    def __init__(self, jobs: int, core: str) -> None:
        self._jobs = jobs
        self._core = core

    def run(self, tasks: Sequence[Task], on_time: OnTime) -> Generator[Ended, None, None]:
        """Yield each task as it ends; closing it ends all.

        A task whose nursery was killed is tried once more with a new one.
        """
        events: Events = Events()
        waiting = list(enumerate(tasks))[::-1]
        attempts = [0] * len(tasks)
        running = 0
        nursery = Nursery(self._core, tasks[0].files["run.json"])
        try:
            while waiting or running:
                while waiting and running < self._jobs:
                    if nursery.is_over:
                        nursery.close()
                        nursery = Nursery(self._core, None)
                    index, task = waiting.pop()
                    attempts[index] += 1
                    nursery.submit(task, events, index)
                    running += 1
                event = events.get()
                if not isinstance(event, Done):
                    on_time(event.tag, event.time_s)
                    continue
                running -= 1
                if event.is_orphan and attempts[event.tag] < _ATTEMPTS:
                    waiting.append((event.tag, tasks[event.tag]))
                else:
                    yield Ended(event.tag, event.error)
        finally:
            nursery.close()
