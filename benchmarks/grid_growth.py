"""How the cost of a grid step grows with the grid: the miniWECC tiled, with ties between tiles."""

from grid_runs import g26_grid, g26_system  # isort: skip

import argparse
import time
from pathlib import Path

import numpy as np

from figures import Row, save

TILES = (1, 2, 4, 8, 16, 32)
RATE, STEPS = 120, 4
"""Steps a second, and steps that are timed together: few, so that the machine's other work shows
in few of the times."""


def step_us(tiles: int, times: int) -> list[float]:
    """Return what an RK4 step of so many tiles costs while they swing, us; the better half."""
    grid = g26_grid(g26_system(tiles), RATE, at_s=1.0 / RATE)
    grid.advance(RATE // 4)
    taken = []
    for _ in range(times):
        began = time.thread_time()
        grid.advance(grid.tick + STEPS)
        taken.append((time.thread_time() - began) * 1e6 / STEPS)
    return sorted(taken)[: times // 2]


def exponent(tiles: list[int], us: list[list[float]], quantile: float) -> float:
    """Return the slope of log cost over log size."""
    cost = [np.quantile(values, quantile) for values in us]
    return float(np.polyfit(np.log(tiles), np.log(cost), 1)[0])


def main() -> None:
    """Measure every size and print the slope from two tiles on."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--times", type=int, default=100, help="repetitions")
    parser.add_argument("--json", type=Path, help="file for the figures")
    options = parser.parse_args()
    us = [step_us(tiles, options.times) for tiles in TILES]
    rows = [
        Row(f"miniWECC, {tiles} tiles, {122 * tiles} buses", "an RK4 step", "us", taken)
        for tiles, taken in zip(TILES, us, strict=True)
    ]
    slopes = [exponent(list(TILES[1:]), us[1:], q) for q in (0.25, 0.5, 0.75)]
    what = f"{TILES[1]} to {TILES[-1]} tiles"
    rows.append(Row(what, "exponent of a step's cost", "", slopes, "at most", 1.15))
    save(rows, options.json)


if __name__ == "__main__":
    main()
