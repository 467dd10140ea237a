"""How many threads a linear algebra library may use."""

from collections.abc import Mapping

VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def one_thread(before: Mapping[str, str]) -> dict[str, str]:
    """Return the variables that keep such libraries to one thread, or to what the user chose.

    The matrices are small: threads cost here more than they give. A library reads the variables
    when it is imported.
    """
    return {variable: before.get(variable, "1") for variable in VARIABLES}
