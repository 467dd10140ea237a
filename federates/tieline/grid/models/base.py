"""What a device model declares: parameters, states, equations and the signals that they exchange.

A model is a class of constants and pure functions; it never holds state. Its equations work on
arrays of all units of the model at once: states `x` (states, n), inputs `u` (inputs, n),
parameters `p` (parameters, n), and they write derivatives `dx` (states, n) and outputs `y`
(outputs, n). A row is named by its index in the model's declaration: `p[P.KA]`, `x[X.V_R]`.

Inputs and outputs are names of signals, one value a unit:

    omega    rotor speed, pu                    delta    rotor angle against the system frame, rad
    v_re, v_im  terminal voltage, pu            vt       its magnitude, pu
    i_re, i_im  terminal current out of the machine, machine base
    Epp_re, Epp_im  voltage behind r_a + j x'', pu
    Pe       electrical power, machine base     Ifd      field current, pu
    Efd      field voltage, pu                  Pm       mechanical power, machine base
    v_s      stabiliser output, pu              wbar     average speed that the unit believes, pu
    Vref     exciter reference, pu              Pref     governor reference, machine base
    w0       synchronous speed, pu              w_s      the same, rad/s
"""

from collections import namedtuple
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numba
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SIGNALS = (
    "omega", "delta", "v_re", "v_im", "vt", "i_re", "i_im", "Epp_re", "Epp_im", "Pe", "Ifd",
    "Efd", "Pm", "v_s", "wbar", "Vref", "Pref", "w0", "w_s",
)  # fmt: skip

ROLES = ("machine", "exciter", "governor", "pss")

_MATRIX = numba.types.Array(numba.types.float64, 2, "C")
SIGNATURE = numba.types.void(_MATRIX, _MATRIX, _MATRIX, _MATRIX, _MATRIX)


@dataclass(frozen=True)
class Parameter:
    """One parameter: the check, the table column and the error text all come from here.

    Attributes:
        symbol: the standard's symbol; `Xd_p` reads X'd.
        unit: `pu` (machine base), `s`, `pu_s`, `rad_s`, `deg`, `MVA` or `1`.
        text: one sentence.
        above, at_least, below, at_most: bounds, each None when there is none.
        default: value where neither table nor experiment gives one; None when one must.
    """

    symbol: str
    unit: str
    text: str
    above: float | None = None
    at_least: float | None = None
    below: float | None = None
    at_most: float | None = None
    default: float | None = None

    @property
    def column(self) -> str:
        """Return the header of the parameter's column in a case table."""
        return self.symbol if self.unit == "1" else f"{self.symbol}_{self.unit}"

    @property
    def bounds(self) -> str:
        """Return the bounds in words, such as `> 0` or `>= 0 and < 1`; empty without any."""
        limits = ((">", self.above), (">=", self.at_least), ("<", self.below), ("<=", self.at_most))
        return " and ".join(f"{sign} {limit:g}" for sign, limit in limits if limit is not None)

    def allows(self, value: float) -> bool:
        """Return whether a value is within the bounds."""
        return (
            (self.above is None or value > self.above)
            and (self.at_least is None or value >= self.at_least)
            and (self.below is None or value < self.below)
            and (self.at_most is None or value <= self.at_most)
        )


@dataclass(frozen=True)
class Equation:
    """A function of a model with the signals that it reads and writes."""

    function: Callable[[Array, Array, Array, Array, Array], None]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]


class Model:
    """The base of every device model; a subclass fills in the class attributes.

    Attributes:
        key: the name that case tables use.
        role: one of `ROLES`.
        source: where the equations come from.
        parameters, states: the rows of `p` and `x`.
        equations: evaluated in order once the terminal voltages are known; a machine's last one
            comes after all controls.
        example: one parameter set by symbol, from `example_source`; every check in the house runs
            on it.
    """

    key: ClassVar[str]
    role: ClassVar[str]
    source: ClassVar[str]
    parameters: ClassVar[tuple[Parameter, ...]]
    states: ClassVar[tuple[str, ...]]
    equations: ClassVar[tuple[Equation, ...]]
    example: ClassVar[Mapping[str, float]]
    example_source: ClassVar[str]

    @classmethod
    def transfer(
        cls, s: complex, p: Mapping[str, float], at: Mapping[str, float]
    ) -> dict[tuple[str, str], complex]:
        """Return the declared transfer functions at `s`, by (input, output) signal.

        They hold inside all limits, for one unit with parameters `p` by symbol, around the signals
        `at` by name. Tests hold the linearised equations against them. A machine declares none.
        """
        return {}

    @classmethod
    def check(cls, values: Mapping[str, float]) -> list[str]:
        """Return what is wrong with one unit's parameters taken together, beyond single bounds."""
        return []

    @classmethod
    def initialise(cls, signals: dict[str, Array], p: Array) -> Array:
        """Return the states (states, n) at rest and set the references that hold them there.

        Args:
            signals: by name, each (n,); those that the network and the models initialised before
                this one have fixed are read, references are written.
            p: (parameters, n).

        Raises:
            ValueError: the operating point lies outside a limit; the message says which, of whom.
        """
        raise NotImplementedError


class Machine(Model):
    """A model that stands behind its own impedance in the network.

    Its `initialise` is the first of its unit's and fixes E_fd, I_fd and P_m for the controls; its
    equations before the last write P_e, I_fd and the terminal current.

    Attributes:
        norton: gives the voltage behind `ra + j xpp` before the network is solved.
        controls: the roles that a unit with this machine may carry besides.
    """

    role = "machine"
    norton: ClassVar[Equation]
    controls: ClassVar[frozenset[str]] = frozenset({"exciter", "governor", "pss"})

    @classmethod
    def impedance(cls, p: Array) -> NDArray[np.complex128]:
        """Return (n,) the impedance behind which `Epp` stands, machine base."""
        raise NotImplementedError

    @classmethod
    def inertia(cls, p: Array) -> Array:
        """Return (n,) H in s, machine base; 0 leaves a unit out of every average of speeds."""
        return p[[parameter.symbol for parameter in cls.parameters].index("H")]


def indices(names: Sequence[str] | Sequence[Parameter]) -> Any:
    """Return a named tuple that gives each name its row: `P.KA` is a compile-time number."""
    words = [name.symbol if isinstance(name, Parameter) else name for name in names]
    return namedtuple("Rows", words)(*range(len(words)))
