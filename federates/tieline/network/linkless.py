"""Opens the engines that have no links, and says what delay they have at least."""

from tieline.errors import InputError
from tieline.network.empirical import EmpiricalDelay
from tieline.network.engine import Engine
from tieline.network.ideal import ConstantDelay
from tieline.network.path_delays import PathDelay, Sites, path_delays
from tieline.network.settings import NetworkSettings
from tieline.network.spec import NetworkSpec
from tieline.units import seconds_to_ns


def least_delay_without_links_ns(
    settings: NetworkSettings, sources: Sites, destinations: Sites
) -> int:
    """Return the time from a measurement in which no packet of an engine without links arrives.

    It is 0 for `helics-filters`, whatever its delay: HELICS takes no message after its instant.

    Raises:
        InputError: a setting that the engine needs is missing, or its trace is faulty.
    """
    if settings.engine == "empirical":
        delays = _path_delays(settings, sources, destinations)
        return min((delay.least_ns for delay in delays), default=0)
    if settings.engine == "ideal":
        return 0
    delay_ns = _delay_ns(settings)
    return 0 if settings.engine == "helics-filters" else delay_ns


def open_without_links(
    settings: NetworkSettings, spec: NetworkSpec, sources: Sites, destinations: Sites, seed: int
) -> Engine:
    """Return an engine without links.

    Args:
        settings: which one, and what it needs.
        spec: sources and destinations.
        sources, destinations: the same, as the run file lists them.
        seed: the experiment's.

    Raises:
        InputError: as `least_delay_without_links_ns`.
        CosimError: HELICS could not start.
    """
    if settings.engine == "empirical":
        delays = _path_delays(settings, sources, destinations)
        assert settings.empirical is not None
        keeps_order = settings.empirical.keep_order
        return EmpiricalDelay(spec, delays, settings.loss or 0.0, keeps_order, seed)
    if settings.engine == "helics-filters":
        # Imported here so that the other engines need no HELICS.
        from tieline.network.helics_filters import HelicsFilters

        return HelicsFilters(spec, _delay_ns(settings), settings.loss or 0.0)
    return ConstantDelay(len(spec.destinations), spec.lookahead_ns)


def _delay_ns(settings: NetworkSettings) -> int:
    if settings.delay is None:
        raise InputError(f"network.delay must be given with network.engine {settings.engine}")
    delay_ns = seconds_to_ns(settings.delay)
    if settings.engine == "helics-filters" and delay_ns == 0:
        raise InputError(
            "network.delay must be above 0 s with network.engine helics-filters"
            " (got 0 s; network.engine ideal has no delay)"
        )
    return delay_ns


def _path_delays(settings: NetworkSettings, sources: Sites, destinations: Sites) -> list[PathDelay]:
    if settings.empirical is None:
        raise InputError(
            "network.empirical must be given with network.engine empirical, such as"
            " {distribution: {distribution: gamma, mean: 80 ms, deviation: 20 ms}}"
        )
    return path_delays(settings.empirical, sources, destinations)
