"""What commands say: text as it is, and an error as its message with its exit code."""

import signal
import threading
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import typer

from tieline.errors import TielineError

if TYPE_CHECKING:
    from rich.console import Console

INTERRUPTED = 130
UNEXPECTED = 1


def console_of(quiet: bool = False, stderr: bool = False) -> "Console":
    """Return where a command prints, nowhere if quiet; what it needs is imported only here."""
    from rich.console import Console

    return Console(quiet=quiet, stderr=stderr)


def say(text: str) -> None:
    """Print text as it is."""
    console_of().print(text, markup=False, highlight=False, soft_wrap=True)


@contextmanager
def reporting(debug: bool = False) -> Iterator[None]:
    """Turn an error into its message and exit code, with its traceback when debugging."""
    try:
        yield
    except (typer.Exit, typer.Abort):
        raise
    except KeyboardInterrupt:
        _complain("interrupted", debug)
        raise typer.Exit(INTERRUPTED) from None
    except TielineError as error:
        _complain(str(error), debug)
        raise typer.Exit(error.exit_code) from None
    except Exception as error:
        advice = "" if debug else "; --debug shows where it arose"
        _complain(f"unexpected {type(error).__name__}: {error}{advice}", debug)
        raise typer.Exit(UNEXPECTED) from None


def _complain(message: str, debug: bool) -> None:
    with _deaf_to_interrupts():
        console = console_of(stderr=True)
        if debug:
            console.print(traceback.format_exc(), markup=False, highlight=False, soft_wrap=True)
        console.print(message, markup=False, highlight=False, soft_wrap=True)


@contextmanager
def _deaf_to_interrupts() -> Iterator[None]:
    """Let no further Ctrl-C stop the last words of a command: it ends with them."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
