"""A run's keeper: a small process that sees to what is left when the launcher itself is killed."""

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tieline.experiment import strays
from tieline.experiment.supervise import child_environment
from tieline.experiment.watch import Progress


class Keeper:
    """Waits for this process's goodbye or death.

    Args:
        work: where the run is written.
        place: where it belongs.
    """

    def __init__(self, work: Path, place: Path) -> None:
        rescue = [sys.executable, "-m", "tieline.experiment.rescue", str(work), str(place)]
        self._granted_ns: dict[str, int] = {}
        self._process = subprocess.Popen(
            # Without site-packages and the user's variables, which it needs none of, it starts
            # in a tenth of the time.
            [sys.executable, "-I", "-S", strays.__file__, str(work), *rescue],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            env=child_environment(),
            # Ctrl-C is for the launcher.
            start_new_session=True,
        )

    def note(self, progress: Progress) -> None:
        """Tell it how far a federate has come."""
        if self._granted_ns.get(progress.federate) != progress.granted_ns:
            self._granted_ns[progress.federate] = progress.granted_ns
            self._tell(json.dumps(self._granted_ns).encode())

    def dismiss(self) -> None:
        """Have it end: everything is in its place."""
        self._tell(strays.GOODBYE)
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.wait()

    def _tell(self, line: bytes) -> None:
        assert self._process.stdin is not None
        try:
            os.write(self._process.stdin.fileno(), line + b"\n")
        except OSError:
            # It was killed: the next run beside this one takes up what it would have.
            return


@contextmanager
def kept(work: Path, place: Path) -> Iterator[Keeper]:
    """Give the keeper of the run in `work`, whose folder is resolved, until it is in its place."""
    keeper = Keeper(work, place)
    try:
        yield keeper
    finally:
        keeper.dismiss()
