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

from figures import Row, save  # noqa: E402
from network.test_ns3_reference import PMUS, wide_area_network  # noqa: E402
from tieline.network.engine import Engine  # noqa: E402
from tieline.network.packet import PacketEngine  # noqa: E402

FRAMES, RATE_HZ, REPETITIONS = 90, 60, 7
HOPS_PER_S, TIMES_NS3 = 4.0, 40
ROOFLINE = """a packet-hop at a plain port reads and writes five lines of 64 bytes (event, packet, \
route, plan, port), a sixth where it waits, and sifts one event of 16 bytes through a heap of up \
to 496 events, five levels of four; all of it (packets, plans, ports and events, about 100 kB) \
fits the second-level cache, so instructions bound it, not memory"""


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


def rates_of(runs: list[dict[str, Any]]) -> list[float]:
    """Return the rate of each run, million packet-hops a CPU second."""
    return [run["hops"] / run["cpu_s"] / 1e6 for run in runs]


def ns3_runs() -> list[dict[str, Any]]:
    """Return one run of ns-3, which allows no second one in a process."""
    from tieline.network.ns3 import Ns3Engine

    engine = Ns3Engine(wide_area_network(), 1)
    run = measured(engine, FRAMES)
    engine.close()
    return [run]


def ns3_in_turn(python: str) -> list[dict[str, Any]]:
    """Return three runs of ns-3 in another interpreter."""
    runs = []
    for _ in range(3):
        command = [python, __file__, "--child"]
        ran = subprocess.run(command, capture_output=True, text=True, check=True)
        runs += json.loads(ran.stdout.splitlines()[-1])
    return runs


def main() -> None:
    """Run every measurement and print it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--ns3", metavar="PYTHON", help="an interpreter that has ns3 and tieline")
    parser.add_argument("--repetitions", type=int, default=REPETITIONS)
    parser.add_argument("--json", type=Path, help="file for the figures")
    parser.add_argument("--child", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.child:
        print(json.dumps(ns3_runs()), flush=True)
        os._exit(0)
    spec = wide_area_network()
    measured(PacketEngine(spec, 1), 1)
    what, unit = "reference wide-area network", "million packet-hops / CPU s"
    rows, digests, rates = [], set(), {}
    for figure, at_a_time in {"in one step": FRAMES, "stepped every 16.7 ms": 1}.items():
        runs = [measured(PacketEngine(spec, 1), at_a_time) for _ in range(options.repetitions)]
        digests |= {run["digest"] for run in runs}
        rates[figure] = rates_of(runs)
        rows.append(Row(what, figure, unit, rates[figure], "at least", HOPS_PER_S))
    cost_ns = [1e3 / rate for rate in rates["in one step"]]
    rows.append(Row(what, "cost of a packet-hop", "ns CPU", cost_ns, "at most", note=ROOFLINE))
    if options.ns3:
        runs = ns3_in_turn(options.ns3)
        digests |= {run["digest"] for run in runs}
        peers = {"ns-3": "3.44"}
        rows.append(Row(what, "ns-3, in one step", unit, rates_of(runs), peers=peers))
        ratio = [rate / median(rates_of(runs)) for rate in rates["in one step"]]
        rows.append(Row(what, "times ns-3", "", ratio, "at least", TIMES_NS3, peers))
    peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e6
    rows.append(Row(what, "peak memory", "MB", [peak_mb]))
    save(rows, options.json)
    if len(digests) > 1:
        sys.exit(f"outcomes differ: {digests}")
    print("every packet the same")


if __name__ == "__main__":
    main()
