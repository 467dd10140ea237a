"""Runs points on the workers of a Dask cluster; needs the extra `tieline[dask]`.

Each worker keeps a nursery for as long as the sweep lasts. A worker that dies takes the points that
it is running with it; Dask gives them to another, and what was finished stands in its folder.
"""

import threading
import time
import uuid
from collections.abc import Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from distributed import Client, Future, WorkerPlugin, as_completed, get_worker

from tieline.errors import CosimError, InputError, TielineError
from tieline.experiment.point import Task, is_finished
from tieline.experiment.sweep_run import Ended, OnTime
from tieline.sweeps.client import Done, Events, Nursery

_CONNECT_S = 20.0
_ATTEMPTS = 3
_FORGET_S = 1.0
"""Within this time a scheduler knows of a worker's death."""


Told = tuple[str, int] | None
"""Message and exit code of a point that failed; None of one that ended well."""


class DaskCluster:
    """Runs tasks on whatever workers a scheduler has, and gets while they run.

    Every worker must see the result folder and the case under the same paths, and have the same
    version of tieline.

    Args:
        address: the scheduler's, such as `tcp://10.0.0.1:8786`.
        core: of the federations.
    """

    def __init__(self, address: str, core: str) -> None:
        self._address = address
        self._core = core

    def run(self, tasks: Sequence[Task], on_time: OnTime) -> Generator[Ended, None, None]:
        """Yield each task as it ends; closing it ends all.

        Raises:
            InputError: there is no scheduler at the address.
            CosimError: the workers cannot load tieline.
        """
        sweep = uuid.uuid4().hex
        plugin = PointsPlugin(self._core, tasks[0].files["run.json"], f"tieline-{sweep}")
        with _connected(self._address) as client, _installed(client, plugin):
            places = {}
            for i, task in enumerate(tasks):
                key = f"tieline-{sweep}-{i}"
                order = client.submit(run_point, task.to_json(), plugin.name, key=key, pure=False)
                places[order] = i
            try:
                for future in as_completed(places, loop=client.loop):
                    yield Ended(places[future], _error_of(future))
            finally:
                client.cancel(list(places), force=True)


class PointsPlugin(WorkerPlugin):
    """A worker's nursery.

    Args:
        core: of the federations.
        rehearsal: content of the run file that is rehearsed.
        name: of the sweep, so that two sweeps on one cluster have a nursery each.
    """

    def __init__(self, core: str, rehearsal: Mapping[str, Any], name: str) -> None:
        self.name = name
        self._core = core
        self._rehearsal = rehearsal

    def setup(self, worker: Any) -> None:
        """Start the nursery, from the thread that lives as long as the worker."""
        self._nursery = Nursery(self._core, self._rehearsal)
        self._lock = threading.Lock()
        self._is_over = False

    def teardown(self, worker: Any) -> None:
        """End the nursery and whatever it runs."""
        with self._lock:
            self._is_over = True
        self._nursery.close()

    def run(self, task: Task) -> Told:
        """Run one task to its end, unless an earlier attempt has finished it."""
        for _ in range(_ATTEMPTS):
            if is_finished(Path(task.folder), task.manifest):
                return None
            done = self._attempt(task)
            if self._is_over or not done.is_orphan:
                break
        return None if done.error is None else (str(done.error), done.error.exit_code)

    def _attempt(self, task: Task) -> Done:
        with self._lock:
            if self._nursery.is_over and not self._is_over:
                self._nursery.close()
                self._nursery = Nursery(self._core, None)
        events: Events = Events()
        self._nursery.submit(task, events)
        while not isinstance(event := events.get(), Done):
            pass
        return event


def run_point(task: Mapping[str, Any], name: str) -> Told:
    """Run one task of a sweep on a Dask worker."""
    plugin: PointsPlugin = get_worker().plugins[name]
    return plugin.run(Task(**task))


@contextmanager
def _connected(address: str) -> Iterator[Client]:
    try:
        client = Client(address, timeout=_CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise InputError(
            f"--scheduler {address}: no Dask scheduler answers there ({error}); start one with"
            " `dask scheduler`, and give the address that it prints"
        ) from error
    with client:
        yield client


@contextmanager
def _installed(client: Client, plugin: PointsPlugin) -> Iterator[None]:
    for attempt in range(1, _ATTEMPTS + 1):
        try:
            client.register_plugin(plugin)
            break
        except OSError as error:
            # A worker that dies just now fails this for all; the next time it is not asked.
            if attempt == _ATTEMPTS:
                raise _unfit(error) from error
            time.sleep(_FORGET_S)
        except Exception as error:
            raise _unfit(error) from error
    try:
        yield
    finally:
        client.unregister_worker_plugin(plugin.name)


def _unfit(error: Exception) -> CosimError:
    return CosimError(
        f"the Dask workers cannot take part: {type(error).__name__}: {error}; every worker needs"
        " the same version of tieline"
    )


def _error_of(future: Future) -> TielineError | None:
    """Return why a task failed; None if it ended well."""
    if future.status == "error":
        error = future.exception()
        return CosimError(f"{type(error).__name__}: {error}")
    if future.status != "finished":
        return CosimError(f"the Dask scheduler gave it up ({future.status})")
    told: Told = future.result()
    if told is None:
        return None
    failure = TielineError(told[0])
    failure.exit_code = told[1]
    return failure
