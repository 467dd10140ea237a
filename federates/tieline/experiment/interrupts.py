"""Ctrl-C and SIGTERM of a run: the first interrupts it, all others only hurry its end."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


class Interrupts:
    """Handles the signals that end a run.

    Attributes:
        is_hurried: whether the user asked again while the run was ending, or first while it could
            not be interrupted.
    """

    def __init__(self) -> None:
        self.is_hurried = False
        self._has_raised = False
        self._is_pending = False
        self._holds = 0

    def __call__(self, number: int, frame: FrameType | None) -> None:
        """Take a signal in."""
        if self._has_raised or self._holds:
            self.is_hurried = True
            self._is_pending = not self._has_raised
            return
        self._has_raised = True
        raise KeyboardInterrupt

    def insist(self) -> None:
        """Interrupt again what goes on in spite of a signal.

        Python drops whatever is raised while it calls back from an import or a finaliser.
        """
        if self._has_raised:
            raise KeyboardInterrupt

    @contextmanager
    def hold(self) -> Iterator[None]:
        """Let nothing interrupt what is inside; a signal that came interrupts at its end."""
        self._holds += 1
        try:
            yield
        finally:
            self._holds -= 1
            if self._is_pending and not self._holds:
                self._is_pending, self._has_raised = False, True
                raise KeyboardInterrupt


def current_interrupts() -> Interrupts:
    """Return what handles the signals now; outside `interruptible` nothing does."""
    handler = signal.getsignal(signal.SIGTERM)
    is_main = threading.current_thread() is threading.main_thread()
    return handler if is_main and isinstance(handler, Interrupts) else Interrupts()


@contextmanager
def interruptible() -> Iterator[Interrupts]:
    """Have SIGTERM and SIGHUP interrupt as Ctrl-C does, and each of them only once.

    Inside another one this is that one. Outside the main thread, or where somebody else handles
    SIGTERM, signals are left alone.
    """
    is_main = threading.current_thread() is threading.main_thread()
    if not is_main or signal.getsignal(signal.SIGTERM) is not signal.SIG_DFL:
        yield current_interrupts()
        return
    interrupts = Interrupts()
    before = {
        number: handler
        for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGINT)
        if (handler := signal.getsignal(number)) in (signal.SIG_DFL, signal.default_int_handler)
    }
    for number in before:
        signal.signal(number, interrupts)
    try:
        yield interrupts
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
