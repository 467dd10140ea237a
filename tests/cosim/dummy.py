"""Federates without physics, whose every byte depends on every byte that they have received.

As a program: `dummy.py grid|network|together RUN.json`. The run file's `dummy` says for each
federate how large its messages are, how long it pauses, and which fault it has, and when.
"""

import hashlib
import json
import os
import random
import sys
import time
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from tieline.cosim import wire
from tieline.cosim.interfaces import GRID, NETWORK
from tieline.cosim.together import main as main_together
from tieline.tables import Column, TableStream

COMMANDS = {
    name: (sys.executable, str(Path(__file__).resolve()), name)
    for name in (GRID, NETWORK, "together")
}


class Dummy:
    """A participant whose messages are pseudo-random bytes made from what it has received.

    It leaves `NAME.digest` when it finishes and `NAME.aborted` when it is told to abort. One that
    records leaves `NAME.parquet`, with a row an interval.
    """

    def __init__(self, name: str, folder: Path, options: dict[str, Any], lead: int = 0) -> None:
        self.name = name
        self._lead = lead
        self._folder = folder
        self._options = options
        self._digest = hashlib.sha256(name.encode()).digest()
        self._pauses = random.Random(options.get("pause_seed", 0))
        self._table: TableStream | None = None
        if options.get("records"):
            path = folder / f"{name}.parquet"
            self._table = TableStream(path, [Column("t_s", "s", "simulated time")])

    def start(self) -> list[bytes]:
        """Return the first message: the grid's, and the network's where it has a lead."""
        return [self._message()] if self.name == GRID or self._lead else []

    def advance(self, k: int, received: bytes) -> bytes:
        """Return the next message, after the pause or the fault that the options ask for."""
        self._digest = hashlib.sha256(self._digest + received).digest()
        if k == self._options.get("fault_at"):
            self._err(self._options["fault"])
        if "pause_s" in self._options:
            time.sleep(self._pauses.random() * self._options["pause_s"])
        if self._table is not None:
            self._table.append({"t_s": np.array([k / 60])})
            self._table.flush()
        return self._message()

    def finish(self) -> None:
        """Write down what was received, and whether HELICS was there."""
        (self._folder / "helics").write_text(str("helics" in sys.modules))
        (self._folder / f"{self.name}.digest").write_text(self._digest.hex())
        self._close()

    def abort(self, reason: str) -> None:
        """Write down why it had to stop."""
        (self._folder / f"{self.name}.aborted").write_text(reason)
        self._close()

    def _close(self) -> None:
        if self._table is not None:
            self._table.close()

    def _message(self) -> bytes:
        draw = np.random.default_rng(list(self._digest))
        largest = self._options.get("size_bytes", 9_000)
        return draw.bytes(int(draw.integers(largest // 2, largest + 1)))

    def _err(self, fault: str) -> None:
        if fault == "raise":
            raise ValueError("the dummy was told to fail")
        if fault == "exit":
            os._exit(7)
        if fault == "warn":
            warnings.warn("the dummy was told to warn", RuntimeWarning, stacklevel=1)
        if fault == "hang":
            time.sleep(3600)


def open_dummy(name: str, run: dict[str, Any], folder: Path) -> Dummy:
    """Return the dummy that a run file describes; its process is noted in `NAME.pid`."""
    (folder / f"{name}.pid").write_text(str(os.getpid()))
    options = run.get("dummy", {}).get(name, {})
    if options.get("fault") == "refuse":
        raise ValueError("the dummy was told not to open")
    if options.get("fault") == "lie":
        wire.Ledger.to_bytes = lambda self: bytes(48)  # type: ignore[method-assign]
    time.sleep(options.get("open_s", 0.0))
    return Dummy(name, folder, options, run["clock"].get("lead", 0))


def write_run(
    folder: Path,
    core: str,
    intervals: int,
    dummies: dict[str, Any],
    lead: int = 0,
    **timeouts: float,
) -> None:
    """Write a run file for dummies into a folder that this makes."""
    folder.mkdir(parents=True, exist_ok=True)
    run = {
        "clock": {"rate_hz": 60, "intervals": intervals, "lead": lead},
        "federation": {"core": core, "broker_port": None, **timeouts},
        "dummy": dummies,
    }
    (folder / "run.json").write_text(json.dumps(run))


if __name__ == "__main__":
    role = sys.argv.pop(1)
    openers = {
        name: lambda run, folder, name=name: open_dummy(name, run, folder)
        for name in (GRID, NETWORK)
    }
    if role == "together":
        main_together(openers)
    else:
        from tieline.cosim.federate import main

        main(role, openers[role])
