"""The network that a run file states."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tieline.network.settings import PACKET_ENGINES, NetworkSettings
from tieline.network.spec import NetworkSpec
from tieline.network.topology import network_spec


def stated_network(run: Mapping[str, Any]) -> tuple[NetworkSettings, NetworkSpec]:
    """Return the settings and the network of a run file's content.

    Raises:
        InputError: the topology is faulty, or a setting that the engine needs is missing.
    """
    stated = run["network"]
    settings = NetworkSettings.model_validate({**stated, "topology": stated["topology"] or "case"})
    topology = Path(settings.topology) if settings.engine in PACKET_ENGINES else None
    return settings, network_spec(settings, topology, run["sources"], run["destinations"])
