"""ANDES's time for 40 s of its 29-machine WECC case with a generator trip, as JSON.

Run by `benchmarks/grid_alone.py --andes PYTHON` with an interpreter that has `andes` installed.
ANDES integrates with the implicit trapezoid; the step is fixed at 1/30 s, as its manual has it.
"""

import json
import logging
import sys
import time

import andes
from andes.utils.paths import get_case

SECONDS, STEP_S = 40.0, 1.0 / 30.0


def run() -> dict[str, float]:
    """Return CPU seconds of one simulation after set-up and power flow, and how it ended."""
    system = andes.load(
        get_case("wecc/wecc_full.xlsx"), default_config=True, no_output=True, setup=False
    )
    system.add("Toggle", {"model": "GENROU", "dev": system.GENROU.idx.v[0], "t": 1.0})
    system.setup()
    system.PFlow.run()
    config = system.TDS.config
    config.tf, config.tstep, config.fixt, config.shrinkt, config.no_tqdm = SECONDS, STEP_S, 1, 0, 1
    config.criteria = 0
    began = time.process_time()
    system.TDS.run()
    taken = time.process_time() - began
    return {"cpu_s": taken, "reached_s": float(system.dae.t), "states": int(system.dae.n)}


def main() -> None:
    """Run as often as the first argument says."""
    logging.disable(logging.ERROR)
    runs = [run() for _ in range(int(sys.argv[1]))]
    print(json.dumps({"version": andes.__version__, "runs": runs}))


if __name__ == "__main__":
    main()
