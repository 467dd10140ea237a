"""What is tried, what came of it, and the guest that takes part in it."""

import sys
from dataclasses import dataclass, field
from pathlib import Path

VISITOR = "visitor"

GUEST = """
import helics, json, subprocess, sys
# A child that left its parent's group and hears no SIGTERM: what a guest's own tools may be like.
deaf = "import signal, time; signal.signal(signal.SIGTERM, signal.SIG_IGN); time.sleep(3600)"
subprocess.Popen([sys.executable, "-S", "-c", deaf], start_new_session=True)
config = json.load(open(sys.argv[1]))
federate = helics.helicsCreateMessageFederateFromConfig(sys.argv[1])
helics.helicsFederateRegisterGlobalEndpoint(federate, "visitor/any")
helics.helicsFederateEnterExecutingMode(federate)
for k in range(config["tieline"]["intervals"]):
    helics.helicsFederateRequestTime(federate, k / 60 + 3e-6)
helics.helicsFederateDisconnect(federate)
"""


@dataclass(frozen=True)
class Trial:
    """One harm.

    Attributes:
        fault: KILL, STOP, TERM, INT, INT INT, FILE LIMIT (no file of the process may grow) or
            FULL DISK.
        victim: launcher, keeper, broker, grid, network, together or visitor.
        phase: start (the victim is there), running (the grid has recorded), finishing (the grid
            has written its table) or whole (the result has its place, or nearly).
        core: of the federation.
        after_s: wall time from the phase's begin to the fault.
        has_older: whether a whole result is at the target already.
    """

    fault: str
    victim: str
    phase: str
    core: str
    after_s: float
    has_older: bool = False

    @property
    def kind(self) -> str:
        """What it is counted under."""
        return f"{self.fault} {self.victim}" if self.fault != "FULL DISK" else self.fault


@dataclass
class Finding:
    """What came of a trial."""

    trial: Trial
    end_s: float = 0.0
    clean_s: float = 0.0
    exit_code: int | None = None
    status: str = ""
    reason: str = ""
    last_valid_s: float | None = None
    busy: float = 1.0
    broken: list[str] = field(default_factory=list)


def write_guest(folder: Path) -> str:
    """Write the guest into a folder and return what an experiment says to have it."""
    (folder / "guest.py").write_text(GUEST)
    command = f"{sys.executable} guest.py {{config}}"
    return f"  guests: [{{name: {VISITOR}, command: '{command}'}}]\n"
