"""Work in a fork: its answer, its failures, and that it never outlives who waits for it."""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest

from tieline.aside import Aside
from tieline.errors import InputError

PATIENCE_S = 20.0


@pytest.fixture(autouse=True)
def _alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have it fork even if earlier tests of this process have left threads."""
    monkeypatch.setattr(threading, "active_count", lambda: 1)


def waited_for(condition: Callable[[], bool]) -> bool:
    """Return whether a condition comes true in good time."""
    limit = time.monotonic() + PATIENCE_S
    while time.monotonic() < limit:
        if condition():
            return True
        time.sleep(0.01)
    return False


def is_alive(pid: int) -> bool:
    """Return whether a process is there and no zombie."""
    try:
        stat = Path(f"/proc/{pid}/stat").read_text(encoding="ascii")
    except OSError:
        return False
    return stat.rpartition(")")[2].split()[0] != "Z"


def test_the_answer_of_the_fork_comes_back_however_long() -> None:
    """A plan that fills the pipe would otherwise make both processes wait for ever."""
    with Aside(lambda word: [os.getpid(), word, "x" * 500_000]).begin("told") as work:
        pid, word, long = work.join()
    assert pid != os.getpid()
    assert (word, len(long)) == ("told", 500_000)


def test_work_that_nobody_began_begins_when_it_is_waited_for() -> None:
    """Both processes would otherwise wait for each other for ever."""
    with Aside(os.getpid) as work:
        assert work.join() != os.getpid()


def test_what_the_work_raises_is_raised_where_it_is_waited_for() -> None:
    """A figure that cannot be drawn would otherwise be missed by whoever looks for it."""

    def refuse(word: str) -> None:
        raise InputError(f"no {word}")

    with Aside(refuse).begin("figure") as work, pytest.raises(InputError, match="no figure"):
        work.join()


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT, signal.SIGTERM])
def test_a_fork_that_was_killed_leaves_its_work_to_its_parent(
    number: signal.Signals, capfd: pytest.CaptureFixture[str]
) -> None:
    """The kernel kills what takes most memory: the result would be whole, but never be drawn.

    A terminal's Ctrl-C reaches the fork, too, which must not print a traceback then.
    """
    parent = os.getpid()

    def told() -> str:
        if os.getpid() != parent:
            os.kill(os.getpid(), number)
        return "done"

    with Aside(told).begin() as work:
        assert waited_for(work.has_ended)
        assert work.join() == "done"
    assert capfd.readouterr().err == ""


def test_nobody_waits_for_a_fork_that_nobody_asked() -> None:
    """A run that failed would otherwise end only when what draws has imported everything."""
    with Aside(lambda: None, prepare=lambda: time.sleep(600)) as work:
        fork = work._fork
        assert fork is not None
        pid = fork._pid
        assert is_alive(pid)
    assert not is_alive(pid)


def test_a_fork_dies_with_its_parent(tmp_path: Path) -> None:
    """A launcher that is killed would otherwise leave a process that draws nothing for anybody."""
    note = tmp_path / "pid"
    script = f"""
import os, time
from pathlib import Path
from tieline.aside import Aside
def work():
    Path({str(note)!r}).write_text(f"{{os.getpid()}} ")
    time.sleep(600)
Aside(work).begin().join()
"""
    parent = subprocess.Popen([sys.executable, "-c", script])
    try:
        assert waited_for(lambda: note.is_file() and note.read_text().endswith(" "))
        pid = int(note.read_text())
        parent.kill()
        parent.wait()
        assert waited_for(lambda: not is_alive(pid))
    finally:
        with suppress(ProcessLookupError):
            parent.kill()
        parent.wait()
