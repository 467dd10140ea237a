"""The broker as a process of its own: `python -m tieline.cosim.broker CORE PORT`.

`--federates` says for how many it waits, `--host` at which address.
"""

import argparse
import json
import signal
import sys

from tieline.cosim.conventions import LOOPBACK, Place
from tieline.cosim.interfaces import FEDERATES
from tieline.cosim.link import Broker
from tieline.cosim.process import die_with_launcher
from tieline.errors import CosimError

_POLL_S = 0.5


def main(argv: list[str] | None = None) -> int:
    """Return the exit code of one federation's broker: 0 once every federate has left."""
    parser = argparse.ArgumentParser(prog="tieline.cosim.broker", description=__doc__)
    parser.add_argument("core", choices=["zmq", "tcp"])
    parser.add_argument("port", type=int)
    parser.add_argument("--federates", type=int, default=len(FEDERATES))
    parser.add_argument("--host", default=LOOPBACK)
    arguments = parser.parse_args(argv)
    place = Place(arguments.core, arguments.port, arguments.host)
    die_with_launcher()
    # It has nothing to save, and a wait inside HELICS would put off a handler of Python's.
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    try:
        broker = Broker(place, arguments.federates)
    except CosimError as error:
        sys.stderr.write(f"{error}\n")
        return error.exit_code
    line = {"federate": "broker", "state": "running"}
    sys.stdout.write(json.dumps(line) + "\n")
    sys.stdout.flush()
    while not broker.wait(_POLL_S):
        pass
    return 0


if __name__ == "__main__":
    sys.exit(main())
