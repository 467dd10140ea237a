"""What every process of a run needs: to die with its launcher, hear signals and end with a code."""

import ctypes
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from tieline.errors import TielineError

LAUNCHER_VARIABLE = "TIELINE_LAUNCHER_PID"
"""Environment variable with the process that a federate must not outlive; unset: none."""

_PR_SET_PDEATHSIG = 1


def die_with_launcher() -> None:
    """Ask the kernel to kill this process when its launcher dies, however that happens.

    A federate started by hand, without `LAUNCHER_VARIABLE`, lives on its own. Where there is no
    prctl the launcher's own clean-up is all there is.
    """
    launcher = os.environ.get(LAUNCHER_VARIABLE)
    if launcher is not None:
        die_with(int(launcher))


def die_with(parent: int) -> None:
    """Ask the kernel to kill this process when its parent dies; only Linux's does."""
    if not sys.platform.startswith("linux"):
        return
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        # It died before the kernel was asked.
        os._exit(1)


def on_termination(act: Callable[[str], None]) -> None:
    """Have `act` called with the signal's name, in a thread of its own, at SIGTERM or SIGINT.

    A Python signal handler waits until the main thread is back from compiled code, which may be
    never when it waits for a grant; the wake-up descriptor is written at once.
    """
    reader, writer = os.pipe()
    os.set_blocking(writer, False)
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: None)
    signal.set_wakeup_fd(writer, warn_on_full_buffer=False)

    def listen() -> None:
        act(signal.Signals(os.read(reader, 1)[0]).name)

    threading.Thread(target=listen, name="termination", daemon=True).start()


@contextmanager
def signals_held() -> Iterator[None]:
    """Keep signals away from the threads that are started inside.

    A HELICS thread whose system call is interrupted may end the process before it is saved.
    """
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGTERM, signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def reason_of(error: BaseException) -> str:
    """Return a failure's message, with its class where it is none of tieline's."""
    if isinstance(error, TielineError):
        return str(error)
    return f"{type(error).__name__}: {error}"


def exit_code_of(error: BaseException) -> int:
    """Return the exit code that stands for an exception."""
    return error.exit_code if isinstance(error, TielineError) else TielineError.exit_code


def end_process(code: int) -> None:
    """End this process.

    After a failure it ends at once: HELICS waits for lost peers in its own clean-up.

    Raises:
        SystemExit: the code is 0.
    """
    sys.stdout.flush()
    sys.stderr.flush()
    if code:
        os._exit(code)
    raise SystemExit(0)
