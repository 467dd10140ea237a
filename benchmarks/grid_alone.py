"""The grid alone on one core: 40 s of the trip of G26, against a fine step, its floor and peers.

The first run on a machine compiles, which is not counted. With `--andes PYTHON`, an interpreter
that has `andes` installed, ANDES's WECC case is simulated in the same run; with `--dpsim PYTHON`
the miniWECC, as far as DPsim has parts for it.
"""

from grid_runs import TRIPPED, Ran, g26_grid, g26_system, simulate, speeds  # isort: skip

import argparse
import json
import subprocess
import tempfile
import time
from pathlib import Path
from statistics import median

import numba
import numpy as np
from like_case import like_case

from figures import Row, save
from tieline.grid.equations import rhs
from tieline.grid.system import System

SECONDS, FINE = 40, 1920
CHEAPEST, OTHERS = ("rk3", 60), (("rk4", 60), ("rk4", 120), ("rk4", 240))
"""Method and steps a second that the accuracy asked for allows, and others: the last one is the
default of experiments, because a packet's value acts from the next step on."""
IN_MOTION = 120
SWEEPS = 9
"""Sweeps over the loads in a right-hand side, the mean of this run."""
FLOPS = {
    "subtransient": 3 * 16 + 2 * 20 + 62,
    "st3_potential": 19,
    "reheat_hydro": 23,
    "generalized_delta_omega": 34,
}
"""Operations of a unit's equations, counted from their text."""
ANGLES = 3
"""Sine and cosine pairs of a machine."""


def work(method: str, rate: int) -> str:
    """Return what is simulated, in words."""
    return f"miniWECC, {SECONDS} s, {method} at {rate} steps a second, recorded at 60 Hz"


def accuracy(system: System, ran: Ran, fine: Ran) -> float:
    """Return the largest difference of a speed to the run in steps of 1/1920 s, pu."""
    return float(np.abs(speeds(system, ran.rows) - speeds(system, fine.rows)).max())


def right_hand_side_us(system: System, times: int = 60) -> list[float]:
    """Return what a right-hand side costs in motion, in each of several runs, us."""
    taken = []
    for _ in range(times):
        grid = g26_grid(system, IN_MOTION, at_s=0.1)
        grid.advance(IN_MOTION)
        began = time.process_time()
        grid.advance(IN_MOTION + 40)
        taken.append((time.process_time() - began) * 1e6 / (4 * 40))
    return sorted(taken)[: times // 2]


@numba.njit
def _multiply_add(x: np.ndarray, times: int) -> float:
    total = 0.0
    for _ in range(times):
        for i in range(len(x)):
            x[i] = x[i] * 0.999999 + 1e-9
    return total + x[0]


@numba.njit
def _turn(x: np.ndarray, times: int) -> float:
    total = 0.0
    for _ in range(times):
        for i in range(len(x)):
            total += np.sin(x[i]) + np.cos(x[i])
    return total


def rate_of(kernel: object, times: int) -> float:
    """Return how many elements a second a kernel takes, the best of many short runs."""
    x = np.linspace(0.1, 1.2, 512)
    kernel(x, 1)  # type: ignore[operator]
    best = np.inf
    for _ in range(200):
        began = time.perf_counter()
        kernel(x, times)  # type: ignore[operator]
        best = min(best, time.perf_counter() - began)
    return times * len(x) / best


def operations(system: System) -> tuple[float, float, float]:
    """Return floating-point operations, sine and cosine pairs, and bytes of a right-hand side."""
    plan = system.plan
    flops = sum(FLOPS[group.model.key] * len(group.units) for group in system.groups)
    entries = len(plan.factors.l_value) + len(plan.factors.u_value)
    buses, loads = len(plan.factors.u_reciprocal), len(plan.loads.bus)
    flops += 2 * (8 * entries + 6 * buses) + SWEEPS * loads * (8 * loads + 40)
    flops += 14 * len(plan.sensors.bus) + 4 * len(system.x0)
    pairs = ANGLES * len(plan.unit_bus) + len(plan.sensors.bus)
    size = plan.jobs.parameters.nbytes + 5 * system.x0.nbytes + 2 * (24 * entries + 80 * buses)
    size += SWEEPS * plan.load_network.transfer.nbytes + 2 * system.work.signals.nbytes
    return float(flops), float(pairs), float(size)


def roofline(system: System, measured_us: list[float]) -> list[Row]:
    """Return what a right-hand side costs beside what its arithmetic alone would."""
    flops, pairs, size = operations(system)
    # Multiply and add, four at a time: what this core does from its first cache.
    flop_rate, pair_rate = 2.0 * rate_of(_multiply_add, 20), rate_of(_turn, 2)
    floor_us = 1e6 * (flops / flop_rate + pairs / pair_rate)
    note = (
        f"the floor: {flops:,.0f} operations at {flop_rate / 1e9:.1f} a ns and {pairs:.0f} sines "
        f"with cosines at {1e9 / pair_rate:.0f} ns; {size / 1e3:.0f} kB pass through the registers "
        "and stay in the second cache, so that memory is no limit"
    )
    return [
        Row("miniWECC in motion", "a right-hand side", "us", measured_us),
        Row("miniWECC in motion", "its arithmetic alone", "us", [floor_us], note=note),
    ]


def alone(system: System, times: int) -> tuple[list[Row], list[float]]:
    """Return the rows of tieline without peers, and its CPU seconds at the longest step."""
    simulate(system, 2, *reversed(CHEAPEST))
    fine = simulate(system, SECONDS, FINE)
    rows, own_s = [], []
    for method, rate in (CHEAPEST, *OTHERS):
        runs = [simulate(system, SECONDS, rate, method) for _ in range(times)]
        cpu_s = [ran.cpu_s for ran in runs]
        reach = 100.0 if (method, rate) == CHEAPEST else None
        what, error = work(method, rate), f"largest error of a speed against rk4 at {FINE}"
        rows += [
            Row(what, "CPU time, integration and recording", "s", cpu_s),
            Row(what, "times real time", "", [SECONDS / s for s in cpu_s], reach=reach),
            Row(what, error, "pu", [accuracy(system, runs[0], fine)], "at most", 1e-6),
        ]
        own_s = own_s or cpu_s
    return rows, own_s


def rhs_alone(system: System) -> Row:
    """Return what one call of the right-hand side from Python costs at rest."""
    x, dx, taken = system.x0.copy(), np.zeros_like(system.x0), []
    for _ in range(300):
        began = time.perf_counter()
        rhs(system.functions, system.plan, system.work, x, dx)
        taken.append((time.perf_counter() - began) * 1e6)
    return Row("miniWECC at rest", "a right-hand side called from Python", "us", taken)


def beside(name: str, command: list[str | Path], own_s: list[float], reach: float) -> list[Row]:
    """Return a peer's simulated seconds a CPU second, and how many times as many tieline's are."""
    ran = subprocess.run(command, capture_output=True, text=True, check=True)
    peer = json.loads(ran.stdout.splitlines()[-1])
    peers = {name: peer["version"]}
    speed = [peer["seconds"] / s for s in peer["cpu_s"]]
    own = SECONDS / median(own_s)
    return [
        Row(peer["work"], f"times real time, {name}", "", speed, peers=peers),
        Row(
            f"{work(*CHEAPEST)}, beside {peer['work']}", f"speed of tieline against {name}", "",
            [own / value for value in speed], reach=reach, peers=peers, note=peer["note"],
        ),
    ]  # fmt: skip


def beside_dpsim(python: str, own_s: list[float]) -> list[Row]:
    """Return DPsim's simulated seconds a CPU second on a like case, and tieline's over them."""
    script = Path(__file__).parent / "peers" / "dpsim_trip.py"
    with tempfile.TemporaryDirectory() as folder:
        case = Path(folder) / "case.json"
        case.write_text(json.dumps(like_case(TRIPPED)))
        return beside("DPsim", [python, script, case], own_s, 3.0)


def main() -> None:
    """Run every measurement and print it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--times", type=int, default=9, help="repetitions")
    parser.add_argument("--andes", metavar="PYTHON", help="an interpreter that has andes")
    parser.add_argument("--dpsim", metavar="PYTHON", help="an interpreter that has dpsim")
    parser.add_argument("--json", type=Path, help="file for the figures")
    options = parser.parse_args()
    system = g26_system()
    rows, own_s = alone(system, options.times)
    rows += roofline(system, right_hand_side_us(system))
    rows.append(rhs_alone(system))
    if options.andes:
        script = Path(__file__).parent / "peers" / "andes_simulation.py"
        rows += beside("ANDES", [options.andes, script], own_s, 40.0)
    if options.dpsim:
        rows += beside_dpsim(options.dpsim, own_s)
    save(rows, options.json)


if __name__ == "__main__":
    main()
