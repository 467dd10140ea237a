"""Starts a module as a process that inherits what its parent has imported already."""

import ctypes
import faulthandler
import os
import runpy
import signal
import sys
import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import IO

_FIRST_INHERITED = 3
_PR_SET_NAME = 15


@dataclass
class Forked:
    """A process that was forked, with pipes on its output."""

    pid: int
    stdout: IO[bytes] | None
    stderr: IO[bytes] | None
    returncode: int | None = None


def forked(command: Sequence[str], environment: Mapping[str, str]) -> Forked:
    """Start `python -m MODULE ARGUMENT...` as a fork, in a session of its own.

    The parent must have one thread only: a lock that another holds would stay held in the fork.

    Args:
        command: begins with the interpreter and `-m`.
        environment: what the module finds in `os.environ`.
    """
    _, _, module, *arguments = command
    reading, writing = zip(os.pipe(), os.pipe(), strict=True)

    def run() -> None:
        _take_name(module)
        os.environ.clear()
        os.environ.update(environment)
        sys.argv = [module, *arguments]
        runpy.run_module(module, run_name="__main__", alter_sys=True)

    pid = fork(run, writing)
    for descriptor in writing:
        os.close(descriptor)
    stdout, stderr = (os.fdopen(descriptor, "rb", buffering=0) for descriptor in reading)
    return Forked(pid, stdout, stderr)


def fork(run: Callable[[], None], output: Sequence[int]) -> int:
    """Return the process number of a fork that does `run` and ends with its exit code.

    Args:
        run: what the fork does; a SystemExit that it raises gives the code, another error 1.
        output: descriptors that become its standard output and standard error.
    """
    sys.stdout.flush()
    sys.stderr.flush()
    pid = os.fork()
    if pid:
        return pid
    code = 1
    try:
        _settle_in(output)
        code = _code_of(run)
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        # Not the parent's way out: what it would clean up there is the parent's.
        os._exit(code)


def _take_name(module: str) -> None:
    """Have `ps` and `top` show a module's own name, such as tieline-grid; only Linux knows how."""
    if sys.platform.startswith("linux"):
        name = f"tieline-{module.rpartition('.')[2]}"
        ctypes.CDLL(None).prctl(_PR_SET_NAME, name.encode())


def _settle_in(output: Sequence[int]) -> None:
    os.setsid()
    signal.set_wakeup_fd(-1)
    for number in (signal.SIGTERM, signal.SIGCHLD):
        signal.signal(number, signal.SIG_DFL)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    nothing = os.open(os.devnull, os.O_RDONLY)
    for target, source in enumerate((nothing, *output)):
        os.dup2(source, target)
    os.closerange(_FIRST_INHERITED, os.sysconf("SC_OPEN_MAX"))
    faulthandler.enable()


def _code_of(run: Callable[[], None]) -> int:
    try:
        run()
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else int(end.code is not None)
    except BaseException:
        traceback.print_exc()
        return 1
    return 0
