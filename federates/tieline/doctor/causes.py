"""What usually stands behind a failed run, and what to do about it."""

import re
from dataclasses import dataclass


@dataclass(frozen=True)
class Cause:
    """A kind of failure.

    Attributes:
        name: one word or two, for programs.
        signs: what is found in the reason, the error's class or the culprit's last lines.
        usual: what it usually comes from.
        advice: what to do.
    """

    name: str
    signs: str
    usual: str
    advice: str


CAUSES = (
    Cause(
        "interrupted",
        r"\binterrupted\b",
        "Somebody pressed Ctrl-C, or SIGTERM came: a batch system's time limit, a closed session.",
        "Run it again; a sweep goes on with tieline sweep --resume FOLDER.",
    ),
    Cause(
        "full disk",
        r"No space left on device|Errno 28|[Dd]isk quota|disk is full",
        "The disk or the quota of the result folder was full.",
        "Make room, or give --out a folder on another disk; network.record_packets and pcap"
        " captures take the most.",
    ),
    Cause(
        "out of memory",
        r"MemoryError|Cannot allocate memory|bad_alloc|ArrowMemoryError",
        "No memory was left.",
        "End other programs, or run fewer points of a sweep at once (--jobs 1).",
    ),
    Cause(
        "killed",
        r"\bSIGKILL\b",
        "Nothing in tieline sends SIGKILL to a run that goes well. Mostly it is the kernel's"
        " out-of-memory killer, or a batch system's memory limit.",
        "Look for 'Out of memory' in dmesg or journalctl -k; run fewer points at once (--jobs 1),"
        " or ask for more memory.",
    ),
    Cause(
        "stopped",
        r"stopped by a signal",
        "SIGSTOP or Ctrl-Z holds the process, or a debugger does.",
        "Let it run on (SIGCONT, fg), or raise federation.hang_timeout while debugging.",
    ),
    Cause(
        "never joined",
        r"has not joined the federation",
        "It was still importing or compiling: the first run on a machine compiles for a minute or"
        " more, and longer where other programs take the processors. Or a firewall keeps it from"
        " the broker.",
        "Run it again, now that compiled code is kept (tieline doctor tells how much); if it stays"
        " so, raise federation.start_timeout.",
    ),
    Cause(
        "hang",
        r"\bhung\b",
        "A federate or a guest computes without end or waits for something outside, or the machine"
        " was asleep or overloaded.",
        "Look at the culprit's last lines and at its processor time; if it was only slow, raise"
        " federation.hang_timeout.",
    ),
    Cause(
        "time contract",
        r"TimeContractBroken|time contract|the contract says",
        "A message or a grant came at another instant than the contract says: a foreign federate"
        " that uses tieline's endpoints, or a defect of tieline.",
        "Without guests or programs of your own in the federation, please report it with run.json"
        " and logs/run.jsonl.",
    ),
    Cause(
        "numerical",
        r"NumericalError|not finite|did not converge|diverged",
        "The mathematics failed: parameters that make no rest point, a step that is too long for a"
        " stiff device, or a disturbance that leaves no solution.",
        "Look at the unit and the time that the message names: its parameters,"
        " grid.steps_per_second, or grid.method: trapezoid.",
    ),
    Cause(
        "not started",
        r"could not be started",
        "The program is not there, may not be executed, or the system allows no more processes.",
        "tieline doctor checks the installation; ulimit -u tells how many processes are allowed.",
    ),
    Cause(
        "crash",
        r"\bSIG(SEGV|BUS|ILL|ABRT|FPE)\b|Fatal Python error",
        "Compiled code of a library failed, often for a stale cache or a mixture of versions.",
        "Delete the cache that tieline doctor names, and install tieline into a fresh environment;"
        " if it stays so, please report it.",
    ),
    Cause(
        "broker lost",
        r"^broker\b|no broker|broker .*gone",
        "HELICS's broker ended early: somebody killed it, or something else uses its port.",
        "Run it again, each run takes new ports; --core inproc and --core local need none.",
    ),
    Cause(
        "terminated",
        r"SIGTERM|\bterminated\b",
        "Something outside ended the process: a batch system, a service manager, a user.",
        "Find out what sends SIGTERM, and run it again.",
    ),
    Cause(
        "peer lost",
        r"the federation ended|\bgone: ",
        "This process met the end of another one, whose own reason is not known here.",
        "Look at the merged log around that time, and on several hosts at the other side's.",
    ),
)
"""In the order in which they are looked for: the first whose signs are there counts."""

LAUNCHER_KILLED = Cause(
    "launcher killed",
    "",
    "The command itself was killed before it could end the run: SIGKILL, a crash of the terminal's"
    " machine, a power cut. Its federates end with it.",
    "Run it again; what was streamed to disk until then is readable.",
)
UNKNOWN = Cause(
    "own error",
    "",
    "The process met an error of its own: the last lines tell which.",
    "If it is none of your files or models, please report it with logs/run.jsonl.",
)


def cause_of(*texts: str) -> Cause:
    """Return what usually stands behind a failure, from the surest text to the least."""
    for text in texts:
        for cause in CAUSES:
            if re.search(cause.signs, text, re.MULTILINE):
                return cause
    return UNKNOWN
