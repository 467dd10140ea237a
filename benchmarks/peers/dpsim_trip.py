"""DPsim's time for 40 s of a network like the miniWECC with a generator trip, as JSON.

Run with an interpreter that has `dpsim` installed. The argument names a file with the same buses,
branches, loads and units as ours at the same operating point, in SI units (`like_case.py`). Loads
are impedances, transformers have their series impedance alone (turns ratio one), and each unit has
DPsim's nearest models: the 6th-order machine, the static exciter, the type-1 governor and PSS1A.
Phasors (domain SP), 1/120 s.
"""

import json
import sys
import time
from importlib.metadata import version
from pathlib import Path

import dpsimpy
from dpsimpy import signal

REPETITIONS = 5
SECONDS, STEP_S, TRIP_S = 40.0, 1.0 / 120.0, 1.0
OPEN_OHM, CLOSED_OHM = 1e9, 1e-4


def machine(unit, node):
    """Return a unit with its controls."""
    made = dpsimpy.sp.ph1.SynchronGenerator6bOrderVBR(unit["name"])
    made.set_operational_parameters_per_unit(
        nom_power=unit["va"], nom_voltage=unit["volt"], nom_frequency=60.0, **unit["machine"]
    )
    s = complex(*unit["power"])
    made.set_initial_values(
        init_complex_electrical_power=s,
        init_mechanical_power=s.real,
        init_complex_terminal_voltage=complex(*unit["voltage"]),
    )
    exciter = signal.ExciterStaticParameters()
    for name, value in unit["exciter"].items():
        setattr(exciter, name, value)
    made.add_exciter(signal.ExciterStatic(f"{unit['name']}-exciter"), exciter)
    pss = signal.PSS1AParameters()
    for name, value in unit["pss"].items():
        setattr(pss, name, value)
    made.add_pss(signal.PSS1A(f"{unit['name']}-pss"), pss)
    if unit["governor"] is not None:
        made.add_governor(**unit["governor"], TmRef=s.real / unit["va"])
    return made


def network(case, nodes):
    """Return lines and loads, connected."""
    parts = []
    for row, (start, end, resistance, inductance, capacitance) in enumerate(case["branches"]):
        line = dpsimpy.sp.ph1.PiLine(f"line{row}")
        line.set_parameters(R=resistance, L=inductance, C=capacitance)
        line.connect([nodes[start], nodes[end]])
        parts.append(line)
    for row, (bus, active, reactive, voltage) in enumerate(case["loads"]):
        load = dpsimpy.sp.ph1.Load(f"load{row}")
        load.set_parameters(active, reactive, voltage)
        load.connect([nodes[bus]])
        parts.append(load)
    return parts


def node_of(name, voltage):
    """Return a node at its voltage of the start."""
    return dpsimpy.sp.SimNode(str(name), dpsimpy.PhaseType.Single, [complex(*voltage)])


def system_of(case):
    """Return the system, its machines, and the breaker of the unit that is tripped."""
    nodes = [node_of(number, voltage) for number, voltage in case["buses"]]
    parts, machines = network(case, nodes), []
    for unit in case["units"]:
        at = nodes[unit["bus"]]
        if unit["is_tripped"]:
            own = node_of(unit["name"], unit["voltage"])
            breaker = dpsimpy.sp.ph1.Switch("breaker")
            breaker.set_parameters(OPEN_OHM, CLOSED_OHM, True)
            breaker.connect([own, at])
            parts.append(breaker)
            at = own
        made = machine(unit, at)
        made.connect([at])
        machines.append(made)
    return dpsimpy.SystemTopology(60, [*nodes, own], [*parts, *machines]), machines, breaker


def run(case):
    """Return CPU seconds of one simulation after set-up."""
    system, machines, breaker = system_of(case)
    simulation = dpsimpy.Simulation("like_case", dpsimpy.LogLevel.off)
    simulation.set_system(system)
    simulation.set_domain(dpsimpy.Domain.SP)
    simulation.set_time_step(STEP_S)
    simulation.set_final_time(SECONDS)
    simulation.do_init_from_nodes_and_terminals(True)
    # The machines' conductances turn with their rotors.
    simulation.do_system_matrix_recomputation(True)
    simulation.set_direct_solver_implementation(dpsimpy.DirectLinearSolverImpl.KLU)
    simulation.add_event(dpsimpy.event.SwitchEvent(TRIP_S, breaker, False))
    simulation.start()
    began, reached = time.process_time(), 0.0
    while reached < SECONDS:
        reached = simulation.next()
    taken = time.process_time() - began
    simulation.stop()
    speeds = [made.attr("w_r").get() for made in machines]
    if not all(speed == speed for speed in speeds):
        raise SystemExit("DPsim's speeds are no numbers")
    return taken


def main():
    """Run several times and print what was taken."""
    case = json.loads(Path(sys.argv[1]).read_text())
    print(
        json.dumps(
            {
                "version": version("dpsim"),
                "work": f"a case like it in DPsim, {len(case['buses'])} buses,"
                f" {len(case['units'])} machines, phasors at {1 / STEP_S:.0f} steps a second",
                "seconds": SECONDS,
                "cpu_s": [run(case) for _ in range(REPETITIONS)],
                "note": "its step is half as long as tieline's; loads are impedances, it records"
                " nothing, and has no PMUs and no wide-area stabilisers",
            }
        )
    )


if __name__ == "__main__":
    main()
