"""Time tags: seconds SOC and fraction FRACSEC against nanoseconds since a run's start."""

from tieline.c37118.constants import TIME_BASE
from tieline.units import NS_PER_S


def soc_fracsec(time_ns: int, epoch_s: int = 0, time_base: int = TIME_BASE) -> tuple[int, int]:
    """Return (SOC, FRACSEC) of an instant, rounded to the nearest tick of `time_base`.

    Args:
        time_ns: nanoseconds since the start of the run.
        epoch_s: SOC of the start of the run, seconds since 1970-01-01 UTC without leap seconds.
        time_base: ticks a second.
    """
    ticks = (2 * time_ns * time_base + NS_PER_S) // (2 * NS_PER_S)
    seconds, fracsec = divmod(ticks, time_base)
    return epoch_s + seconds, fracsec


def time_ns(soc: int, fracsec: int, epoch_s: int = 0, time_base: int = TIME_BASE) -> int:
    """Return nanoseconds since the start of the run, rounded to the nearest; see `soc_fracsec`."""
    fraction_ns = (2 * fracsec * NS_PER_S + time_base) // (2 * time_base)
    return (soc - epoch_s) * NS_PER_S + fraction_ns
