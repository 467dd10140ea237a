"""ANDES's own eigenvalue routine on its 29-machine WECC case, as JSON on the last line.

Run by `benchmarks/linear.py --andes PYTHON` with an interpreter that has `andes` installed.
"""

import json
import logging
import time

import andes
from andes.utils.paths import get_case

REPETITIONS = 5


def main() -> None:
    """Time the state matrix, with and without the Jacobians it is made of, and its modes.

    `TDS.init` and `itm_step` are what `EIG.sweep` does to renew the Jacobians at each point.
    """
    logging.disable(logging.ERROR)
    system = andes.load(get_case("wecc/wecc_full.xlsx"), default_config=True, no_output=True)
    system.PFlow.run()
    system.EIG.run()
    jacobians, state_matrix, modes = [], [], []
    for _ in range(REPETITIONS):
        start = time.perf_counter()
        system.TDS.init()
        system.TDS.itm_step()
        jacobians.append(time.perf_counter() - start)
        start = time.perf_counter()
        system.EIG.calc_As()
        state_matrix.append(time.perf_counter() - start)
        start = time.perf_counter()
        system.EIG.calc_pfactor()
        modes.append(time.perf_counter() - start)
    print(
        json.dumps(
            {
                "version": andes.__version__,
                "states": len(system.EIG.mu),
                "jacobians_s": jacobians,
                "state_matrix_s": state_matrix,
                "modes_s": modes,
            }
        )
    )


if __name__ == "__main__":
    main()
