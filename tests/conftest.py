"""Settings of all tests: one thread each, time to compile inside a hypothesis example, the order.

The matrices are small and tests run side by side: threads of a linear algebra library would wait
for each other most of the time.
"""

import os
from pathlib import Path

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import pytest  # noqa: E402
from hypothesis import settings  # noqa: E402

settings.register_profile("tieline", deadline=None)
settings.load_profile("tieline")

LONGEST = (
    "scenarios/test_g26_under_delay.py",
    "conformance/test_device_models.py",
    "scenarios/test_same_bits.py",
    "cases/test_linear_reference.py",
    "conformance/test_bypass.py",
    "experiment/test_launch.py",
    "faults/test_trials.py",
    "scenarios/test_linkless_engines.py",
)
"""Files that take a minute or more on a computer where nothing is compiled."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put the longest files first: the last one to begin should not be waited for."""
    here = Path(__file__).parent

    def place(item: pytest.Item) -> int:
        name = item.path.relative_to(here).as_posix()
        return LONGEST.index(name) if name in LONGEST else len(LONGEST)

    items.sort(key=place)
