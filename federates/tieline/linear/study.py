"""Operating points for linear analysis: a case, its stabilisers, its loads, one call.

from tieline.linear import freqresp, modes

modes("two_area", pss="generalized", gain=25, beta1=0.5, beta2=0.5).table()
freqresp("miniwecc", unit="G2", beta1=1, beta2=0.5, delay_s=1.25).over([0.1, 0.5])
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from tieline.errors import InputError
from tieline.grid.average import continuous_average
from tieline.grid.case import Case, load_case
from tieline.grid.check import sensor_buses
from tieline.grid.load_mix import with_load_mix
from tieline.grid.models.registry import use_file
from tieline.grid.powerflow import solve_power_flow
from tieline.grid.pss_settings import PssSettings
from tieline.grid.settings import LoadSettings
from tieline.grid.stabilisers import with_pss
from tieline.grid.system import System, build_system
from tieline.linear.linearise import LinearSystem, linearise
from tieline.linear.modes import Modes, modes_of
from tieline.linear.response import Response, open_loop
from tieline.problems import checked
from tieline.resources import case_folder
from tieline.wams.settings import WamsSettings

AVERAGES = ("sensor", "rotor")


@dataclass(frozen=True)
class Study:
    """What is analysed: everything that the operating point and the equations depend on.

    Attributes:
        case: name of a shipped case, a folder, or a loaded case.
        pss: `none`, `case`, `standard`, `generalized`, or any other model by its name.
        gain, beta1, beta2: as in an experiment; None takes the case's own.
        average: wbar from PMU frequencies (`sensor`) or from rotor speeds (`rotor`).
        weights: `equal`, `H`, `H_MVA`, or a list.
        units: units whose stabiliser is in service.
        file: a Python file with models of one's own.
        loads: how every load answers to voltage and frequency; None as the case says.
        inertia: factor on the inertia constants of the units `inertia_of`.
    """

    case: str | Path | Case
    pss: str = "generalized"
    gain: float | None = None
    beta1: float | None = None
    beta2: float | None = None
    average: str = "sensor"
    weights: str | Sequence[float] = "equal"
    units: Literal["all"] | Sequence[str] = "all"
    file: str | None = None
    loads: LoadSettings | None = None
    inertia: float = 1.0
    inertia_of: Literal["all"] | Sequence[str] = "all"

    def system(self) -> System:
        """Return the system at its operating point.

        Raises:
            InputError: a setting that the case does not allow, or none allows.
            NumericalError: the power flow diverges, or a limit is violated at the start.
        """
        use_file("pss", self.file)
        case = with_load_mix(self.loaded(), self.loads)
        pss, wams = self._settings()
        case = with_pss(_with_inertia(case, self.inertia, self.inertia_of), pss)
        sensors = sensor_buses(case, wams)
        average = continuous_average(case, sensors, wams, pss.average, 0)
        return build_system(case, solve_power_flow(case), sensors, average)

    def loaded(self) -> Case:
        """Return the case as it is stored.

        Raises:
            InputError: there is none, or it is malformed.
        """
        if isinstance(self.case, Case):
            return self.case
        path = Path(self.case)
        return load_case(path if (path / "case.yaml").is_file() else case_folder(str(self.case)))

    def _settings(self) -> tuple[PssSettings, WamsSettings]:
        if self.average not in AVERAGES:
            raise InputError(f"average must be one of {', '.join(AVERAGES)} (got '{self.average}')")
        units = self.units if isinstance(self.units, str) else list(self.units)
        weights = self.weights if isinstance(self.weights, str) else list(self.weights)
        tuning = {name: getattr(self, name) for name in ("gain", "beta1", "beta2")}
        numbers = {name: None if value is None else float(value) for name, value in tuning.items()}
        wanted = {
            "file": self.file,
            "model": self.pss,
            "average": f"{self.average}s",
            "units": units,
            **numbers,
        }
        pss, problems = checked(PssSettings, wanted)
        wams, others = checked(WamsSettings, {"reporting": "continuous", "weights": weights})
        if pss is None or wams is None:
            raise InputError([problem.text for problem in (*problems, *others)])
        return pss, wams


def modes(case: str | Path | Case, **settings: Any) -> Modes:
    """Return the modes of a case at its operating point, the average undelayed.

    Args:
        case: name of a shipped case, a folder, or a loaded case.
        settings: fields of `Study`, such as `pss="standard"` or `gain=25`.

    Raises:
        InputError: as `Study.system`.
    """
    return modes_of(linear(case, (), **settings))


def linear(case: str | Path | Case, cut_pss: Sequence[str] = (), **settings: Any) -> LinearSystem:
    """Return a case to first order around its operating point; see `modes`.

    Args:
        case: as for `modes`.
        cut_pss: units whose stabiliser is cut from its exciter.
        settings: fields of `Study`.
    """
    return linearise(Study(case, **settings).system(), cut_pss)


def freqresp(
    case: str | Path | Case,
    unit: str,
    delay_s: float | Sequence[float] = 0.0,
    beta1: float | None = None,
    beta2: float | None = None,
    **settings: Any,
) -> Response:
    """Return the open loop H(s) = -v_s / V_ref of one unit, the only one with a stabiliser, K = 1.

    Args:
        case: as for `modes`.
        unit: the unit, such as `G2`.
        delay_s: delay of the average, s, one for all sensors or one each; the local speed has none.
        beta1: share of the speed against the average.
        beta2: share of the average against synchronous.
        settings: further fields of `Study`, such as `average="rotor"`.

    Raises:
        InputError: as `Study.system`, or there is no such unit.
    """
    chosen: dict[str, Any] = {
        "gain": 1.0,
        "beta1": beta1,
        "beta2": beta2,
        "units": [unit],
        **settings,
    }
    return open_loop(linear(case, [unit], **chosen), unit, delay_s)


def _with_inertia(case: Case, factor: float, units: Literal["all"] | Sequence[str]) -> Case:
    if factor == 1.0:
        return case
    if not factor > 0:
        raise InputError(f"inertia must be > 0 times the case's (got {factor:g})")
    devices = tuple(
        replace(device, values={**device.values, "H": factor * device.values["H"]})
        if (units == "all" or device.unit in units) and "H" in device.values
        else device
        for device in case.devices["machine"]
    )
    return replace(case, devices={**case.devices, "machine": devices})
