"""DC2A, the DC commutator exciter of IEEE Std 421.5 whose regulator is fed from the terminals."""

from types import MappingProxyType

from tieline.grid.models.base import Array, Equation
from tieline.grid.models.exciters.dc1a import DC1A, excite


def equations(x: Array, u: Array, p: Array, dx: Array, y: Array) -> None:
    """Write E_fd from V_t, v_s and V_ref."""
    y[0] = excite(x, u, p, dx, u[0])


class DC2A(DC1A):
    """The exciter `dc1a` with regulator limits in proportion to the terminal voltage.

        V_ref - V_C + v_s - V_F ->[(1+sTC)/(1+sTB)]->[KA/(1+sTA)]-> V_R -> as in DC1A -> E_fd
                                                     V_t VRmin..V_t VRmax

    Parameters, bypasses and saturation are those of `dc1a`. Not modelled: under- and overexcitation
    limiter inputs, load compensation, effect of speed.
    """

    key = "dc2a"
    source = "IEEE Std 421.5-2005, section 5.2, figure 5-2; DC2C of 421.5-2016 adds limiter inputs"
    example = MappingProxyType(
        {
            "TR": 0.0, "TC": 0.0, "TB": 0.0, "KA": 300.0, "TA": 0.01, "VRmax": 4.95, "VRmin": -4.9,
            "TE": 1.33, "KE": 1.0, "KF": 0.1, "TF": 0.675, "E1": 2.29, "SE1": 0.117, "E2": 3.05,
            "SE2": 0.279, "Efdmin": 0.0,
        }
    )  # fmt: skip
    example_source = "sample data of IEEE Std 421.5-2005, Annex H"
    equations = (Equation(equations, ("vt", "v_s", "Vref"), ("Efd",)),)

    @classmethod
    def initialise(cls, signals: dict[str, Array], p: Array) -> Array:
        """Return the states that give the machine's E_fd, and set V_ref."""
        return cls.at_rest(signals, p, signals["vt"])
