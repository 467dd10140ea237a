"""One classical machine against an infinite bus.

G1 (1) ---- two equal lines ---- (2) infinite bus
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tieline.errors import InputError
from tieline.grid.average import rotor_weights
from tieline.grid.case import Case, load_case
from tieline.grid.equations import rhs
from tieline.grid.powerflow import solve_power_flow
from tieline.grid.simulation import Grid
from tieline.grid.system import System, build_system, rotor_average

H, XD_P, X_LINE, POWER = 3.5, 0.3, 0.4, 0.9

TABLES = {
    "case.yaml": """
name: single
title: one machine against an infinite bus
base_MVA: 100
frequency_Hz: 60
areas: ["1"]
sensors: [1]
""",
    "bus.csv": f"""
bus,base_kV,kind,v_pu,theta_deg,p_gen_pu,p_load_pu,q_load_pu,g_shunt_pu,b_shunt_pu,q_gen_max_pu,\
q_gen_min_pu,area
1,230,pv,1.0,0,{POWER},0,0,0,0,9,-9,1
2,230,slack,1.0,0,0,0,0,0,0,9,-9,1
""",
    "branch.csv": f"""
from_bus,to_bus,circuit,resistance_pu,reactance_pu,susceptance_pu,tap_ratio,phase_shift_deg,kind
1,2,1,0,{2 * X_LINE},0,1,0,line
1,2,2,0,{2 * X_LINE},0,1,0,line
""",
    "machine.csv": f"""
unit,bus,model,base_MVA,H_s,D_pu,ra_pu,xd_p_pu,x_pu
G1,1,classical,100,{H},0,0,{XD_P},
INF,2,infinite_bus,100,,,0,,1e-6
""",
}


def write(folder: Path, tables: dict[str, str]) -> Path:
    for name, text in tables.items():
        (folder / name).write_text(text.lstrip())
    return folder


@pytest.fixture
def single(tmp_path: Path) -> Case:
    return load_case(write(tmp_path, TABLES))


def build(case: Case) -> System:
    average = rotor_average(rotor_weights(case, "equal"))
    return build_system(case, solve_power_flow(case), case.base.sensors, average)


def test_the_rotor_swings_at_the_frequency_of_the_swing_equation(single: Case) -> None:
    """omega_n = sqrt(omega_s K_s / 2H) with K_s = E' V cos(delta) / x, Kundur section 12.3.1."""
    system = build(single)
    rows = [system.labels.index(name) for name in ("delta.G1", "omega.G1")]
    jacobian = np.zeros((2, 2))
    for at, row in enumerate(rows):
        for sign in (1.0, -1.0):
            x, dx = system.x0.copy(), np.zeros_like(system.x0)
            x[row] += sign * 1e-6
            rhs(system.functions, system.plan, system.work, x, dx)
            jacobian[:, at] += sign * dx[rows] / 2e-6
    infinite = system.labels.index("delta.INF")
    angle = system.x0[rows[0]] - system.x0[infinite]
    K_s = POWER / np.tan(angle)
    expected = np.sqrt(120 * np.pi * K_s / (2 * H))
    # The bus stands behind 1e-6 pu, and differences of 1e-6 have errors of 1e-9.
    np.testing.assert_allclose(np.linalg.eigvals(jacobian).imag.max(), expected, rtol=1e-5)


def test_an_infinite_bus_counts_in_no_average_of_speeds(single: Case) -> None:
    """Counted with any weight it would hide the motion of the machines."""
    system = build(single)
    x = system.x0.copy()
    x[system.labels.index("omega.G1")] = 1.01
    grid = Grid(replace(system, x0=x), method="rk4", steps_per_second=240)
    assert grid.centre_of_inertia() == pytest.approx(1.01, abs=1e-15)
    assert grid.signal("wbar") == pytest.approx(1.01, abs=1e-15)


def test_an_infinite_bus_holds_its_voltage_through_a_swing(single: Case) -> None:
    """That is what it is for."""
    system = build(single)
    x = system.x0.copy()
    x[system.labels.index("omega.G1")] = 1.01
    grid = Grid(replace(system, x0=x), method="rk4", steps_per_second=240)
    grid.advance(120)
    assert abs(grid.x[system.labels.index("delta.G1")] - x[0]) > 0.1
    # A current of 1 pu through 1e-6 pu.
    np.testing.assert_allclose(grid.voltages()[1], 1.0, atol=3e-6)
    assert grid.x[system.labels.index("omega.INF")] == 1.0


def test_a_classical_machine_takes_no_exciter(tmp_path: Path) -> None:
    """E' would be the exciter's output, one stage late; it is a constant instead."""
    exciter = "unit,model,TR_s,TC_s,TB_s,KA_pu,TA_s,VRmax_pu,VRmin_pu\nG1,simple,0,0,0,9,1,5,-5\n"
    folder = write(tmp_path, {**TABLES, "exciter.csv": exciter})
    with pytest.raises(InputError, match="'G1' is a classical, which takes no exciter"):
        load_case(folder)
