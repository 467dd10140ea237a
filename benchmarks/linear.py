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


def said(what: str, taken: list[float], unit: float = 1.0, name: str = "s") -> None:
    """Print a median and its spread."""
    low, high = min(taken) * unit, max(taken) * unit
    print(f"{what:60} {median(taken) * unit:8.2f} {name} ({low:.2f} to {high:.2f})")


def beside_andes(python: str, system: System) -> None:
    """Print ANDES's times for its WECC case and ours for the miniWECC, of like size."""
    script = Path(__file__).parent / "peers" / "andes_modes.py"
    ran = subprocess.run([python, script], capture_output=True, text=True, check=True)
    peer = json.loads(ran.stdout.splitlines()[-1])
    name = f"ANDES {peer['version']}, {peer['states']} states"
    said(f"{name}: state matrix of ready Jacobians", peer["state_matrix_s"], 1e3, "ms")
    said(f"{name}: the Jacobians", peer["jacobians_s"], 1e3, "ms")
    said(f"{name}: modes and participations", peer["modes_s"], 1e3, "ms")
    linear = linearise(system)
    modes = seconds(lambda: modes_of(linear).participation, 5)
    said(f"tieline, {len(linear.A)} states: modes and participations", modes, 1e3, "ms")


def main() -> None:
    """Run every measurement and print it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tiles", type=int, default=16, help="copies of the miniWECC")
    parser.add_argument("--andes", metavar="PYTHON", help="an interpreter that has andes")
    options = parser.parse_args()
    tiles = options.tiles
    study = Study("miniwecc", gain=25.0, beta1=0.5, beta2=0.5)
    system = study.system()
    A = linearise(system).A
    print(f"miniWECC, {len(A)} states")
    said("linearise, A", seconds(lambda: linearise(system).A, 25), 1e3, "ms")

    def sweep() -> None:
        for beta1 in np.linspace(0.0, 1.0, POINTS):
            modes_of(linearise(retuned(system, "pss", {"beta1": float(beta1)})))

    def bare() -> None:
        for _ in range(POINTS):
            eig(A, left=True, right=True)

    ratios = []
    for _ in range(3):
        ratios.append(seconds(sweep, 1)[0] / seconds(bare, 1)[0])
    said(f"{POINTS} points of beta1 against {POINTS} bare LAPACK calls", ratios, name="times")

    if options.andes:
        beside_andes(options.andes, system)

    large = Study(tiled(load_case(case_folder("miniwecc")), tiles), gain=9.0, beta1=1.0, beta2=0.5)
    began = time.perf_counter()
    found = descriptor(linearise(large.system()))
    print(f"{tiles} tiles, {found.states} states: built in {time.perf_counter() - began:.2f} s")
    said(
        f"{COUNT} least damped modes from {BAND_HZ[0]} to {BAND_HZ[1]} Hz",
        seconds(lambda: least_damped(found, BAND_HZ, COUNT), 1),
    )
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e6
    print(f"peak memory {peak:.0f} MB")


if __name__ == "__main__":
    main()
