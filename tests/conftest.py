"""Settings of all tests: one thread each, and time to compile inside a hypothesis example.

The matrices are small and tests run side by side: threads of a linear algebra library would wait
for each other most of the time.
"""

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

from hypothesis import settings  # noqa: E402

settings.register_profile("tieline", deadline=None)
settings.load_profile("tieline")
