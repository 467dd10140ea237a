"""Loads ns-3 from its wheel and compiles the classes that this engine adds to it."""

from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from tieline.errors import InputError

_MODULES = ("core", "network", "internet", "point-to-point")
_SOURCE = Path(__file__).with_name("network.h")


def check_installed() -> None:
    """Raise InputError unless the ns3 wheel and cppyy, which it needs, are installed."""
    if find_spec("ns3") is None or find_spec("cppyy") is None:
        raise InputError(
            "network.engine ns3 needs the ns-3 wheel, which is not installed:"
            " pip install 'tieline[ns3]'"
        )


@cache
def model() -> Any:
    """Return the C++ namespace `tieline`, with ns-3 behind it, loaded once a process.

    The wheel's own `ns` module takes in all of ns-3, which needs a minute of processor time and
    650 MB; these four of its libraries take two seconds and 200 MB.

    Raises:
        InputError: the wheel is not installed.
    """
    check_installed()
    import cppyy

    found = find_spec("ns3")
    [folder] = [Path(place) for place in found.submodule_search_locations]  # type: ignore[union-attr]
    cppyy.add_include_path(str(folder / "include"))
    for module in _MODULES:
        # Before the headers, whose initialisers call the libraries.
        [library] = folder.glob(f"lib*/libns3*-{module}.so")
        cppyy.load_library(str(library))
    cppyy.include(str(_SOURCE))
    namespace = cppyy.gbl.tieline
    # Other threads say meanwhile that this process is alive.
    namespace.Network.RunUntil.__release_gil__ = True
    return namespace
