"""Does a piece of work in a fork of this process, while the process does another."""

import os
import sys
import threading
import traceback
import warnings
from collections.abc import Callable


class Aside:
    """Work that goes on in a fork; it must leave its results in files.

    Where forking is not safe (further threads, another system) the work is done at `join`.
    """

    def __init__(self, work: Callable[[], object]) -> None:
        self._work = work
        self._pid = None
        if sys.platform.startswith("linux") and threading.active_count() == 1:
            self._pid = _forked(work)

    def join(self) -> None:
        """Return once the work is done; if the fork failed at it, it is done again here.

        Raises:
            Exception: whatever the work raises.
        """
        if self._pid is None or os.waitstatus_to_exitcode(os.waitpid(self._pid, 0)[1]):
            self._work()


def _forked(work: Callable[[], object]) -> int:
    sys.stdout.flush()
    sys.stderr.flush()
    with warnings.catch_warnings():
        # Arrow and the linear algebra keep threads that see to themselves at a fork.
        warnings.simplefilter("ignore", DeprecationWarning)
        pid = os.fork()
    if pid:
        return pid
    code = 1
    try:
        work()
        code = 0
    except Exception:
        # What went wrong is met again, and told, by whoever waits.
        traceback.clear_frames(sys.exc_info()[2])
    finally:
        os._exit(code)
