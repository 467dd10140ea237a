"""Linear analysis on one core: linearisation, a sweep beside bare LAPACK, modes of a large system.

The first run on a machine compiles: run it twice. With `--andes PYTHON`, an interpreter that has
`andes` installed, ANDES's eigenvalue routine is timed on its own WECC case beside the miniWECC.
"""

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"

import argparse  # noqa: E402
import json  # noqa: E402
import resource  # noqa: E402
import subprocess  # noqa: E402
import time  # noqa: E402
from collections.abc import Callable  # noqa: E402
from pathlib import Path  # noqa: E402
from statistics import median  # noqa: E402

import numpy as np  # noqa: E402
from scipy.linalg import eig  # noqa: E402

from figures import Row, save  # noqa: E402
from tieline.grid.case import load_case  # noqa: E402
from tieline.grid.system import System  # noqa: E402
from tieline.grid.tile import tiled  # noqa: E402
from tieline.linear import Study, linearise, modes_of  # noqa: E402
from tieline.linear.retune import retuned  # noqa: E402
from tieline.linear.sparse import descriptor, least_damped  # noqa: E402
from tieline.resources import case_folder  # noqa: E402

POINTS = 21
BAND_HZ, COUNT = (0.1, 1.0), 20


def seconds(work: Callable[[], object], times: int) -> list[float]:
    """Return how long each of several repetitions took."""
    taken = []
    for _ in range(times):
        began = time.perf_counter()
        work()
        taken.append(time.perf_counter() - began)
    return taken


def beside_andes(python: str, system: System) -> list[Row]:
    """Return ANDES's times for its WECC case and ours for the miniWECC, of like size."""
    script = Path(__file__).parent / "peers" / "andes_modes.py"
    ran = subprocess.run([python, script], capture_output=True, text=True, check=True)
    peer = json.loads(ran.stdout.splitlines()[-1])
    peers = {"ANDES": peer["version"]}
    name = f"ANDES's WECC case, {peer['states']} states"
    linear = linearise(system)
    modes_s = seconds(lambda: modes_of(linear).participation, 5)
    linearise_s = seconds(lambda: linearise(system).A, 5)
    jacobians_s = [
        sum(pair) for pair in zip(peer["jacobians_s"], peer["state_matrix_s"], strict=True)
    ]
    return [
        Row(name, "Jacobians and state matrix", "ms", scaled(jacobians_s, 1e3), peers=peers),
        Row(
            f"miniWECC, {len(linear.A)} states",
            "linearisation against ANDES's Jacobians and state matrix",
            "times as fast",
            [median(jacobians_s) / taken for taken in linearise_s],
            peers=peers,
        ),
        Row(name, "modes and participations", "ms", scaled(peer["modes_s"], 1e3), peers=peers),
        Row(
            f"miniWECC, {len(linear.A)} states",
            "modes and participations",
            "ms",
            scaled(modes_s, 1e3),
        ),
    ]


def scaled(values: list[float], by: float) -> list[float]:
    """Return values in another unit."""
    return [value * by for value in values]


def small(system: System) -> list[Row]:
    """Return the figures of the miniWECC."""
    A = linearise(system).A
    name = f"miniWECC, {len(A)} states"
    taken = scaled(seconds(lambda: linearise(system).A, 25), 1e3)
    rows = [Row(name, "linearisation", "ms", taken, "at most", 10.0)]

    def sweep() -> None:
        for beta1 in np.linspace(0.0, 1.0, POINTS):
            modes_of(linearise(retuned(system, "pss", {"beta1": float(beta1)})))

    def bare() -> None:
        for _ in range(POINTS):
            eig(A, left=True, right=True)

    ratios = [seconds(sweep, 1)[0] / seconds(bare, 1)[0] for _ in range(3)]
    what = f"{POINTS} points of beta1 against {POINTS} bare LAPACK calls"
    return [*rows, Row(name, what, "times the time", ratios, "at most", 1.3)]


def large(tiles: int) -> list[Row]:
    """Return the figures of a system of many miniWECCs."""
    case = tiled(load_case(case_folder("miniwecc")), tiles)
    found = descriptor(linearise(Study(case, gain=9.0, beta1=1.0, beta2=0.5).system()))
    name = f"{tiles} tiles, {found.states} states"
    taken = seconds(lambda: least_damped(found, BAND_HZ, COUNT), 3)
    what = f"{COUNT} least damped modes from {BAND_HZ[0]} to {BAND_HZ[1]} Hz"
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e6
    return [
        Row(name, what, "s", taken, "at most", 5.0),
        Row(name, "peak memory, libraries included", "MB", [peak], "at most", 1000.0),
    ]


def main() -> None:
    """Run every measurement and print it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tiles", type=int, default=16, help="copies of the miniWECC")
    parser.add_argument("--andes", metavar="PYTHON", help="an interpreter that has andes")
    parser.add_argument("--json", type=Path, help="file for the figures")
    options = parser.parse_args()
    system = Study("miniwecc", gain=25.0, beta1=0.5, beta2=0.5).system()
    rows = small(system)
    if options.andes:
        rows += beside_andes(options.andes, system)
    save([*rows, *large(options.tiles)], options.json)


if __name__ == "__main__":
    main()
