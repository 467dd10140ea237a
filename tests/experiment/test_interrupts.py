"""Ctrl-C once and twice, as the launcher takes it."""

import os
import signal

import pytest
import typer
from rich.console import Console

from tieline import console
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


class Careless:
    """Is interrupted where Python drops what is raised."""

    def __del__(self) -> None:
        press()


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_what_goes_on_in_spite_of_a_signal_is_interrupted_again() -> None:
    """If not, Ctrl-C in the wrong microsecond would be lost, and all that follow with it."""
    with interruptible() as interrupts:
        interrupts.insist()
        Careless()
        with pytest.raises(KeyboardInterrupt):
            interrupts.insist()


def test_the_last_words_of_a_command_are_not_interrupted(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """If not, Ctrl-C twice would end in a traceback."""
    import_of_rich = console.console_of

    def slow(stderr: bool) -> Console:
        press()
        return import_of_rich(stderr=stderr)

    monkeypatch.setattr(console, "console_of", slow)
    with pytest.raises(typer.Exit) as end, console.reporting():
        raise KeyboardInterrupt
    assert end.value.exit_code == console.INTERRUPTED
    assert capsys.readouterr().err == "interrupted\n"
    with pytest.raises(KeyboardInterrupt):
        press()


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
