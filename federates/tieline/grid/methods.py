"""The integration methods by the names that experiments use."""

from tieline.grid.implicit import Trapezoid
from tieline.grid.integrate import METHODS, Integrator, RungeKutta
from tieline.grid.system import System

NAMES = ("trapezoid", *METHODS)


def integrator(method: str, system: System, h: float) -> Integrator:
    """Return a method, one of `NAMES`, ready to integrate a system in steps of `h` seconds."""
    if method == "trapezoid":
        return Trapezoid(system, h)
    return RungeKutta(system, METHODS[method], h)
