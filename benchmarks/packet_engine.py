"""Packet-hops per CPU second on a 40-router network, beside ns-3 on the same network.

30 PMUs send 60 frames a second to 34 controllers each, with eight on-off cross flows (the network
of tests/network/data). The engine is run in one step and in steps of a sixtieth of a second. With
`--ns3 PYTHON`, an interpreter that has the `ns3` wheel and this project, ns-3 carries the same
packets in the same run, and both must deliver each at the same nanosecond.
"""

import argparse
import hashlib
import json
import os
import resource
import subprocess
import sys
import time
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests"))

from network.test_ns3_reference import PMUS, wide_area_network  # noqa: E402
from tieline.network.engine import Engine  # noqa: E402
from tieline.network.packet import PacketEngine  # noqa: E402

FRAMES, RATE_HZ, REPETITIONS = 90, 60, 7


def measured(engine: Engine, frames_at_a_time: int) -> dict[str, Any]:
    """Return packet-hops, CPU seconds, and a hash of every delivery and drop."""
    digest = hashlib.sha256()
    payloads = np.zeros((PMUS, 34), np.uint8)
    began = time.process_time()
    outcomes = []
    for k in range(FRAMES):
        at_ns = k * 10**9 // RATE_HZ
        engine.send(at_ns, np.arange(PMUS), k, payloads)
        if k % frames_at_a_time == frames_at_a_time - 1:
            outcomes.append(engine.run_until(at_ns))
    outcomes.append(engine.run_until(FRAMES * 10**9 // RATE_HZ + 10**9))
    cpu_s = time.process_time() - began
    for part in ("arrivals", "drops"):
        digest.update(np.concatenate([getattr(outcome, part) for outcome in outcomes]).tobytes())
    hops = sum(link.packets for link in engine.links())
    return {"hops": hops, "cpu_s": cpu_s, "digest": digest.hexdigest()}


def said(what: str, runs: list[dict[str, Any]]) -> float:
    """Print the rate of several runs, and return its median, hops a CPU second."""
    rates = [run["hops"] / run["cpu_s"] for run in runs]
    low, high = min(rates) / 1e6, max(rates) / 1e6
    print(f"{what:44} {median(rates) / 1e6:7.3f} million packet-hops/s ({low:.3f} to {high:.3f})")
    return median(rates)


def ns3_runs() -> list[dict[str, Any]]:
    """Return one run of ns-3, which allows no second one in a process."""
    from tieline.network.ns3 import Ns3Engine

    engine = Ns3Engine(wide_area_network(), 1)
    run = measured(engine, FRAMES)
    engine.close()
    return [run]


def main() -> None:
    """Run every measurement and print it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--ns3", metavar="PYTHON", help="an interpreter that has ns3 and tieline")
    parser.add_argument("--child", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.child:
        print(json.dumps(ns3_runs()), flush=True)
        os._exit(0)
    spec = wide_area_network()
    measured(PacketEngine(spec, 1), 1)
    steps = {"tieline, in one step": FRAMES, "tieline, stepped every 16.7 ms": 1}
    rates, digests = {}, set()
    for what, frames_at_a_time in steps.items():
        runs = [measured(PacketEngine(spec, 1), frames_at_a_time) for _ in range(REPETITIONS)]
        digests |= {run["digest"] for run in runs}
        rates[what] = said(what, runs)
    print(f"peak memory {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e6:.0f} MB")
    if options.ns3:
        runs = []
        for _ in range(3):
            command = [options.ns3, __file__, "--child"]
            ran = subprocess.run(command, capture_output=True, text=True, check=True)
            runs += json.loads(ran.stdout.splitlines()[-1])
        rate = said("ns-3 3.44, in one step", runs)
        digests |= {run["digest"] for run in runs}
        print(f"tieline against ns-3: {rates['tieline, in one step'] / rate:.0f} times")
    print("every packet the same" if len(digests) == 1 else f"outcomes differ: {digests}")


if __name__ == "__main__":
    main()
