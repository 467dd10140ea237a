"""Ends what a run has started, by the mark in its environment; as a program, a run's keeper.

As a program it waits for the launcher of a run: a goodbye, or the end of its standard input, which
is the launcher's death. Then it ends every process of the run and has what was written rescued.
It imports nothing but small parts of the standard library, not even pathlib, since it starts with
every run.
"""

import os
import signal
import sys
import time

RUN_VARIABLE = "TIELINE_RUN"
"""Environment variable of every process of a run, guests and their children included: its folder.
"""

GOODBYE = b"goodbye"

_LOOK_S = 0.02
_GRACE_S = 0.3
_LIMIT_S = 3.0
_READ_BYTES = 65_536
_LONGEST_BYTES = 65_536


def strays(folder: str) -> list[int]:
    """Return the living processes of the run in `folder`, or of any run inside it.

    None where there is no /proc; neither are those of other users, nor what cleared its
    environment.
    """
    mark = f"{RUN_VARIABLE}={folder}".encode()
    found = []
    try:
        names = os.listdir("/proc")  # noqa: PTH208
    except OSError:
        return []
    for name in names:
        if name.isdigit() and int(name) != os.getpid() and _is_marked(name, mark):
            found.append(int(name))
    return found


def end_strays(folder: str, grace_s: float = _GRACE_S) -> None:
    """End the processes of a run that are left: SIGTERM first, SIGKILL after `grace_s`."""
    begin_s = time.monotonic()
    number = signal.SIGTERM
    while (left := strays(folder)) and time.monotonic() < begin_s + _LIMIT_S:
        if time.monotonic() >= begin_s + grace_s:
            number = signal.SIGKILL
        for pid in left:
            try:
                os.kill(pid, number)
            except ProcessLookupError:
                continue
        time.sleep(_LOOK_S)


def main() -> None:
    """Keep the run whose folder and place the arguments name; what follows them rescues it."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    folder, *rescue = sys.argv[1:]
    heard = b""
    while data := os.read(0, _READ_BYTES):
        heard = (heard + data)[-_LONGEST_BYTES:]
    lines = heard.split(b"\n")
    if GOODBYE in lines:
        return
    end_strays(folder)
    # Cut at both ends, the last line that is whole tells how far the federates were.
    told = lines[-2] if len(lines) > 1 else b""
    os.execv(rescue[0], [*rescue, os.fsdecode(told)])


def _is_marked(pid: str, mark: bytes) -> bool:
    try:
        # A process that has died is still listed until it is reaped; its environment is empty.
        with open(f"/proc/{pid}/environ", "rb") as file:  # noqa: PTH123
            variables = file.read().split(b"\0")
    except OSError:
        return False
    return any(each == mark or each.startswith(mark + b"/") for each in variables)


if __name__ == "__main__":
    main()
