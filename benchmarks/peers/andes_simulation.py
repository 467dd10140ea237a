"""ANDES's simulation of its 29-machine WECC case at its usual step, as JSON on the last line.

Run by `benchmarks/grid_alone.py --andes PYTHON` with an interpreter that has `andes` installed.
"""

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"

import json  # noqa: E402
import logging  # noqa: E402
import time  # noqa: E402

import andes  # noqa: E402
from andes.utils.paths import get_case  # noqa: E402

REPETITIONS = 3
SECONDS, STEP_S = 20.0, 1.0 / 30.0


def main() -> None:
    """Time the simulation alone: the case is loaded and its power flow solved before."""
    logging.disable(logging.ERROR)
    taken = []
    for _ in range(REPETITIONS):
        system = andes.load(get_case("wecc/wecc_full.xlsx"), default_config=True, no_output=True)
        system.PFlow.run()
        system.TDS.config.tf = SECONDS
        system.TDS.config.fixt = 1
        system.TDS.config.tstep = STEP_S
        system.TDS.config.no_tqdm = 1
        began = time.process_time()
        if not system.TDS.run():
            raise SystemExit("ANDES did not reach the end")
        taken.append(time.process_time() - began)
    print(
        json.dumps(
            {
                "version": andes.__version__,
                "work": f"ANDES's WECC case, {system.Bus.n} buses, {system.GENROU.n} machines, "
                f"{system.dae.n} states, implicit trapezoidal rule at 30 steps a second",
                "seconds": SECONDS,
                "cpu_s": taken,
                "note": "its step is twice as long as tieline's, and its error is not known",
            }
        )
    )


if __name__ == "__main__":
    main()
