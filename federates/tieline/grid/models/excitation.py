"""What the exciters of IEEE Std 421.5 share: the parameters of their regulators, and transfers."""

from collections.abc import Mapping

from tieline.grid.models.base import Parameter

TR = Parameter("TR", "s", "transducer time constant; 0 bypasses it", at_least=0)
VImax = Parameter("VImax", "pu", "upper limit of the voltage error", above=0)
VImin = Parameter("VImin", "pu", "lower limit of the voltage error", below=0)
TC = Parameter("TC", "s", "lead time constant of the transient gain reduction", at_least=0)
TB = Parameter("TB", "s", "lag of the transient gain reduction; TB = TC = 0 bypass it", at_least=0)
KA = Parameter("KA", "pu", "regulator gain", above=0)
TA = Parameter("TA", "s", "regulator time constant; 0 bypasses it", at_least=0)
VAmax = Parameter("VAmax", "pu", "upper limit of the regulator", above=0)
VAmin = Parameter("VAmin", "pu", "lower limit of the regulator")
VRmax = Parameter("VRmax", "pu", "upper limit of the regulator's output", above=0)
VRmin = Parameter("VRmin", "pu", "lower limit of the regulator's output")
KC = Parameter("KC", "pu", "rectifier loading by the commutating reactance", at_least=0)
KF = Parameter("KF", "pu", "gain of the rate feedback", at_least=0)
TF = Parameter("TF", "s", "time constant of the rate feedback", above=0)
TE = Parameter("TE", "s", "exciter time constant", above=0)
KE = Parameter("KE", "pu", "exciter constant of a self-excited field")
E1 = Parameter("E1", "pu", "exciter voltage of the lower saturation point", above=0)
SE1 = Parameter("SE1", "pu", "saturation at E1", at_least=0)
E2 = Parameter("E2", "pu", "exciter voltage of the upper saturation point", above=0)
SE2 = Parameter("SE2", "pu", "saturation at E2", at_least=0)


def over_error(
    forward: complex, s: complex, p: Mapping[str, float]
) -> dict[tuple[str, str], complex]:
    """Return E_fd over v_s, V_ref and, through the transducer, V_t for a response to the error."""
    return {
        ("v_s", "Efd"): forward,
        ("Vref", "Efd"): forward,
        ("vt", "Efd"): -forward / (1 + s * p["TR"]),
    }
