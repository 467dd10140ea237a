"""Ctrl-C once and twice, as the launcher takes it."""

import os
import signal

import pytest

from tieline.experiment.interrupts import current_interrupts, interruptible


def press(number: signal.Signals = signal.SIGINT) -> None:
    """Send this process a signal; its handler has run when this returns."""
    os.kill(os.getpid(), number)


def test_only_the_first_of_several_signals_interrupts() -> None:
    """If not, an impatient user would interrupt the saving of what was written."""
    with interruptible() as interrupts:
        with pytest.raises(KeyboardInterrupt):
            press()
        assert not interrupts.is_hurried
        press()
        press(signal.SIGTERM)
        assert interrupts.is_hurried


def save(done: list[str]) -> None:
    """Note what is done while a signal comes in the middle of what must not be interrupted."""
    with current_interrupts().hold():
        with current_interrupts().hold():
            press(signal.SIGTERM)
        done.append("whole")
    done.append("after")


def test_a_signal_waits_for_the_end_of_what_must_not_be_interrupted() -> None:
    """If not, Ctrl-C could come between the end of a run and its folder's name."""
    done: list[str] = []
    with interruptible(), pytest.raises(KeyboardInterrupt):
        save(done)
    assert done == ["whole"]


def test_handlers_are_as_they_were_afterwards() -> None:
    """If not, a notebook could not be interrupted after its first run."""
    before = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]
    with interruptible() as outer, interruptible() as inner:
        assert inner is outer
    assert [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)] == before
