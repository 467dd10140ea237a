"""Faults that a process cannot be given from outside, in whatever Python process finds this first.

SIGUSR1 raises an exception in the main thread; a process whose command line holds $INJECT_NEVER
never gets beyond its start.
"""

import os
import signal
import sys
import time


def _raise(*_: object) -> None:
    raise RuntimeError("injected by benchmarks/helics_faults.py")


signal.signal(signal.SIGUSR1, _raise)
_never = os.environ.get("INJECT_NEVER")
if _never and any(_never in word for word in sys.orig_argv):
    while True:
        time.sleep(1)
