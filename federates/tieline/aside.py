"""Does a piece of work in a fork of this process, while the process does another."""

import json
import os
import select
import signal
import sys
import threading
import traceback
import warnings
from collections.abc import Callable
from contextlib import suppress
from types import TracebackType
from typing import Any, Self

from tieline.cosim.process import die_with, signals_held
from tieline.garbage import collecting_later

_ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_READ_BYTES = 65_536


class Aside:
    """Work that goes on in a fork, which answers with plain data or leaves results in files.

    The fork ends with this process at the latest. Where forking is not safe (further threads,
    another system), or where it failed, the work is done here once it is waited for.

    Args:
        work: given the words of `begin`, returns what JSON carries unchanged.
        prepare: what the fork does before, such as imports that only it will need.
    """

    def __init__(
        self, work: Callable[..., Any], prepare: Callable[[], object] = lambda: None
    ) -> None:
        self._work = work
        self._words: tuple[str, ...] | None = None
        self._fork: _Fork | None = None
        if sys.platform.startswith("linux") and threading.active_count() == 1:
            self._fork = _Fork(work, prepare)

    def begin(self, *words: str) -> Self:
        """Have the work done with these words."""
        self._words = words
        if self._fork is not None:
            self._fork.tell(words)
        return self

    def has_ended(self) -> bool:
        """Return whether the fork is done or has failed, so that `join` finds out at once."""
        return self._fork is None or self._fork.has_answered()

    def join(self) -> Any:
        """Return the answer of the work, which begins now if it has not begun.

        Raises:
            Exception: whatever the work raises.
        """
        words = self._words
        if words is None:
            words = ()
            self.begin()
        fork, self._fork = self._fork, None
        answer = None if fork is None else fork.answer()
        return self._work(*words) if answer is None else answer["answer"]

    def close(self) -> None:
        """End the fork if nobody has waited for its answer."""
        if self._fork is not None:
            self._fork.end()
            self._fork = None

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """End the fork."""
        self.close()


class _Fork:
    """The process, and the pipes to and from it: a line of JSON each way."""

    def __init__(self, work: Callable[..., Any], prepare: Callable[[], object]) -> None:
        launcher = os.getpid()
        orders, self._orders = os.pipe()
        self._answers, answers = os.pipe()
        sys.stdout.flush()
        sys.stderr.flush()
        # A signal must find either this process's handlers or the fork's.
        with signals_held(), warnings.catch_warnings():
            # Arrow and the linear algebra keep threads that see to themselves at a fork.
            warnings.simplefilter("ignore", DeprecationWarning)
            self._pid = os.fork()
            if self._pid == 0:
                os.close(self._orders)
                os.close(self._answers)
                _serve(launcher, orders, answers, work, prepare)
        os.close(orders)
        os.close(answers)

    def tell(self, words: tuple[str, ...]) -> None:
        # One that is gone already is noticed by its missing answer.
        with suppress(BrokenPipeError):
            os.write(self._orders, json.dumps(words).encode() + b"\n")

    def has_answered(self) -> bool:
        return bool(select.select([self._answers], [], [], 0)[0])

    def answer(self) -> dict[str, Any] | None:
        """Return its answer, None if it failed; it has ended by then."""
        try:
            line = _line_from(self._answers)
        except BaseException:
            self.end()
            raise
        self._close()
        code = os.waitstatus_to_exitcode(os.waitpid(self._pid, 0)[1])
        answer: dict[str, Any] | None = json.loads(line) if line and not code else None
        return answer

    def end(self) -> None:
        os.kill(self._pid, signal.SIGKILL)
        os.waitpid(self._pid, 0)
        self._close()

    def _close(self) -> None:
        os.close(self._orders)
        os.close(self._answers)


def _serve(
    launcher: int,
    orders: int,
    answers: int,
    work: Callable[..., Any],
    prepare: Callable[[], object],
) -> None:
    """Do the work in the fork, and end it."""
    code = 1
    try:
        die_with(launcher)
        for number in _ENDING:
            signal.signal(number, signal.SIG_DFL)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, _ENDING)
        with collecting_later():
            prepare()
        line = _line_from(orders)
        if line:
            answer = {"answer": work(*json.loads(line))}
            _write(answers, json.dumps(answer).encode() + b"\n")
            code = 0
    except Exception:
        # What went wrong is met again, and told, by whoever waits.
        traceback.clear_frames(sys.exc_info()[2])
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def _line_from(descriptor: int) -> bytes:
    """Return one line, empty if whoever writes is gone before it is whole."""
    line = b""
    while not line.endswith(b"\n"):
        data = os.read(descriptor, _READ_BYTES)
        if not data:
            return b""
        line += data
    return line


def _write(descriptor: int, data: bytes) -> None:
    while data:
        data = data[os.write(descriptor, data) :]
