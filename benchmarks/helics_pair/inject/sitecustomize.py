"""Faults that a process cannot be given from outside, in whatever Python process finds this first.

SIGUSR1 raises an exception in the main thread; a process whose command line holds $INJECT_NEVER
never gets beyond its start. Each process gets a thread more, which does nothing: `tieline run` then
starts programs in the place of forks of itself, so that its federates find this, too.
"""

import os
import signal
import sys
import threading
import time


def _raise(*_: object) -> None:
    raise RuntimeError("injected by benchmarks/helics_faults.py")


signal.signal(signal.SIGUSR1, _raise)
threading.Thread(target=threading.Event().wait, name="idle", daemon=True).start()
_never = os.environ.get("INJECT_NEVER")
if _never and any(_never in word for word in sys.orig_argv):
    while True:
        time.sleep(1)
