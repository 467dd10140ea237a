"""A case with a mistake: it is refused in sentences that name file, line and what is allowed."""

from pathlib import Path

import pytest

from grid.spoiled import added, cell, copied, findings_of, replaced, without_column, written
from tieline.grid.case import load_case

# Lines: bus N and branch N stand on line N + 1; unit GN stands on line N + 1 of every device table
# that has them all (machine, exciter, pss).
MISTAKES = {
    "unknown column": (
        replaced("bus.csv", "theta_deg", "theta_dg"),
        ["bus.csv:1: no column 'theta_dg'; did you mean 'theta_deg'?"],
    ),
    "missing column": (
        without_column("branch", "tap_ratio"),
        ["branch.csv:1: column 'tap_ratio' is missing"],
    ),
    "missing parameter column": (
        without_column("governor", "Tc_s"),
        ["governor.csv:2: reheat_hydro needs the columns Tc_s"],
    ),
    "column twice": (
        replaced("bus.csv", "q_load_pu", "p_load_pu"),
        ["bus.csv:1: column 'p_load_pu' stands twice"],
    ),
    "short line": (
        added("branch.csv", "1,2,9"),
        ["branch.csv:173: has 3 cells, the header 9"],
    ),
    "long line": (
        replaced("load.csv", "8,0,1,0,0,load,", "8,0,1,0,0,load,,x"),
        ["load.csv:2: has 8 cells, the header 7"],
    ),
    "text for a number": (
        cell("bus", 3, "p_load_pu", "much"),
        ["bus.csv:3: 'p_load_pu' must be a number (got 'much')"],
    ),
    "number of another script": (
        cell("bus", 3, "p_load_pu", "1_0"),
        ["bus.csv:3: 'p_load_pu' must be a number (got '1_0')"],
    ),
    "empty cell": (
        cell("machine", 3, "H_s", ""),
        ["machine.csv:3: 'H_s' must be a number (got '')"],
    ),
    "infinite number": (
        cell("branch", 4, "reactance_pu", "inf"),
        ["branch.csv:4: 'reactance_pu' must be finite (got 'inf')"],
    ),
    "number too large": (
        cell("branch", 4, "reactance_pu", "1e999"),
        ["branch.csv:4: 'reactance_pu' must be finite (got '1e999')"],
    ),
    "no number": (
        cell("machine", 3, "H_s", "NaN"),
        ["machine.csv:3: 'H_s' must be finite (got 'NaN')"],
    ),
    "fraction for a bus": (
        cell("machine", 3, "bus", "3.0"),
        ["machine.csv:3: 'bus' must be a whole number from 1 to 999999999 (got '3.0')"],
    ),
    "superscript for a bus": (cell("load", 3, "bus", "²"), ["load.csv:3: 'bus' must be a whole"]),
    "two signs": (cell("branch", 3, "circuit", "--1"), ["branch.csv:3: 'circuit' must be a whole"]),
    "bus 0": (cell("bus", 3, "bus", "0"), ["bus.csv:3: 'bus' must be a whole number from 1"]),
    "bus twice": (
        added("bus.csv", "7,20,pq,1,0,0,0,0,0,0,0,0,BC,source"),
        ["bus.csv:124: bus 7 stands already in bus.csv:8"],
    ),
    "kind of bus": (
        cell("bus", 3, "kind", "pQ"),
        ["bus.csv:3: 'kind' must be one of slack, pv, pq (got 'pQ')"],
    ),
    "kind of bus with a near word": (
        cell("bus", 3, "kind", "slak"),
        ["bus.csv:3: 'kind' must be one of slack, pv, pq (got 'slak'; did you mean 'slack'?)"],
    ),
    "zero voltage": (cell("bus", 3, "v_pu", "0"), ["bus.csv:3: 'v_pu' must be > 0 (got 0)"]),
    "negative base": (
        cell("bus", 3, "base_kV", "-500"),
        ["bus.csv:3: 'base_kV' must be > 0 (got -500)"],
    ),
    "reactive limits crossed": (
        cell("bus", 2, "q_gen_max_pu", "-50"),
        ["bus.csv:2: 'q_gen_max_pu' must be >= 'q_gen_min_pu'", "(got -50 and -45)"],
    ),
    "two slacks": (
        cell("bus", 2, "kind", "slack"),
        ["is a second slack bus, after bus.csv:2"],
    ),
    "no slack": (
        replaced("bus.csv", ",slack,", ",pv,"),
        ["bus.csv:1: needs one bus of kind slack"],
    ),
    "unknown area": (
        cell("bus", 2, "area", "nWst"),
        ["bus.csv:2: no area 'nWst'; did you mean 'nWest'?"],
    ),
    "generation without a unit": (
        cell("bus", 3, "p_gen_pu", "2"),
        ["bus.csv:3: bus 2 has no unit in machine.csv", "(got pq and 2)"],
    ),
    "held voltage without a unit": (
        cell("bus", 3, "kind", "pv"),
        ["bus.csv:3: bus 2 has no unit in machine.csv", "(got pv and 0)"],
    ),
    "unknown bus of a branch": (
        cell("branch", 2, "to_bus", "1220"),
        ["branch.csv:2: no bus '1220'; did you mean '122'?"],
    ),
    "unknown bus of a load": (cell("load", 2, "bus", "888"), ["load.csv:2: no bus '888'"]),
    "unknown bus of a machine": (cell("machine", 2, "bus", "555"), ["machine.csv:2: no bus '555'"]),
    "zero impedance": (
        cell("branch", 2, "reactance_pu", "0"),
        ["branch.csv:2: resistance_pu and reactance_pu must not both be 0"],
    ),
    "zero tap": (
        cell("branch", 2, "tap_ratio", "0"),
        ["branch.csv:2: 'tap_ratio' must be > 0, 1 without a tap (got 0)"],
    ),
    "negative tap": (cell("branch", 2, "tap_ratio", "-1"), ["'tap_ratio' must be > 0"]),
    "branch twice": (
        added("branch.csv", "1,2,1,0,0.1,0,1,0,line"),
        ["branch.csv:173: branch 1-2 stands already in branch.csv:2"],
    ),
    "branch twice, turned round": (
        added("branch.csv", "2,1,1,0,0.1,0,1,0,line"),
        ["branch.csv:173: branch 1-2 stands already in branch.csv:2"],
    ),
    "branch to itself": (
        added("branch.csv", "2,2,1,0,0.1,0,1,0,line"),
        ["branch.csv:173: from_bus and to_bus must differ (got 2 twice)"],
    ),
    "shares above 1": (
        cell("load", 2, "p_constant_power", "0.5"),
        ["load.csv:2: shares of p must be >= 0 and sum to <= 1 (got 0.5 and 1)"],
    ),
    "negative share": (
        cell("load", 2, "q_constant_current", "-0.5"),
        ["load.csv:2: shares of q must be >= 0 and sum to <= 1 (got 0 and -0.5)"],
    ),
    "load at a bus without one": (
        cell("load", 2, "bus", "2"),
        ["load.csv:2: bus 2 has no load in bus.csv"],
    ),
    "load twice": (
        cell("load", 3, "bus", "8"),
        ["load.csv:3: load of bus 8 stands already in load"],
    ),
    "unknown model": (
        cell("exciter", 2, "model", "st3_potental"),
        ["exciter.csv:2: 'model' must be one of", "did you mean 'st3_potential'?"],
    ),
    "zero time constant": (
        cell("pss", 4, "T2_s", "0"),
        ["pss.csv:4: delta_omega.T2 of 'G3' must be > 0 s (got 0)"],
    ),
    "wrong sign of a limit": (
        cell("pss", 4, "vsmin_pu", "0.1"),
        ["pss.csv:4: delta_omega.vsmin of 'G3' must be < 0 pu (got 0.1)"],
    ),
    "reactances out of order": (
        cell("machine", 4, "xd_p_pu", "1.3"),
        ["machine.csv:4: subtransient of 'G3' needs xl < xd_pp <= xd_p <= xd (got", "xd_p = 1.3"],
    ),
    "zero rating": (cell("machine", 4, "base_MVA", "0"), ["machine.csv:4: 'base_MVA' must be > 0"]),
    "unit without a name": (
        cell("machine", 4, "unit", ""),
        ["machine.csv:4: 'unit' must not be empty"],
    ),
    "unit twice": (
        cell("machine", 4, "unit", "G2"),
        ["machine.csv:4: machine of unit G2 stands already in machine.csv:3"],
    ),
    "two exciters": (
        cell("exciter", 4, "unit", "G2"),
        ["exciter.csv:4: exciter of unit G2 stands already in exciter.csv:3"],
    ),
    "PSS for an unknown unit": (
        cell("pss", 4, "unit", "G333"),
        ["pss.csv:4: no unit 'G333'; did you mean 'G33'?"],
    ),
    "PSS without an exciter": (
        lambda folder: (folder / "exciter.csv").unlink(),
        ["pss.csv:2: unit 'G1' has a PSS but no exciter to act on"],
    ),
    "missing table": (
        lambda folder: (folder / "branch.csv").unlink(),
        ["branch.csv: missing in miniwecc/"],
    ),
    "folder for a table": (
        lambda folder: ((folder / "load.csv").unlink(), (folder / "load.csv").mkdir()),
        ["load.csv: cannot be read"],
    ),
    "empty table": (written("bus.csv", b""), ["bus.csv:1: is empty; its header needs bus, kind"]),
    "blank table": (written("bus.csv", b"\n\n\n"), ["bus.csv:1: is empty"]),
    "header alone": (
        lambda folder: (folder / "machine.csv").write_text(
            (folder / "machine.csv").read_text().splitlines()[0]
        ),
        ["machine.csv:1: has no machine"],
    ),
    "no UTF-8": (written("load.csv", b"bus,\xff\xfe"), ["load.csv: is not UTF-8 text (byte 4)"]),
    "a quote that does not end": (
        replaced("branch.csv", "3,4,1,0", '3,"4,1,0'),
        ["branch.csv:3: is malformed"],
    ),
    "unknown key": (
        replaced("case.yaml", "base_MVA", "base_MV"),
        ["case.yaml:3: unknown key 'base_MV' (did you mean 'base_MVA'?)"],
    ),
    "missing key": (replaced("case.yaml", "title:", "#"), ["case.yaml:1: missing key 'title'"]),
    "unknown key of the tie mode": (
        replaced("case.yaml", "against:", "againts:"),
        ["case.yaml:9: unknown key 'againts' in tie_mode (did you mean 'against'?)"],
    ),
    "text for a base": (
        replaced("case.yaml", "base_MVA: 100", "base_MVA: '100'"),
        ["case.yaml:3: base_MVA must be a number (got '100')"],
    ),
    "infinite base": (
        replaced("case.yaml", "base_MVA: 100", "base_MVA: .inf"),
        ["base_MVA must be"],
    ),
    "frequency": (
        replaced("case.yaml", "frequency_Hz: 60", "frequency_Hz: 55"),
        ["case.yaml:4: frequency_Hz must be one of 50, 60 (got 55)"],
    ),
    "areas": (
        replaced("case.yaml", "[Alberta, BC, North, nWest, sWest, East]", "Alberta"),
        ["case.yaml:5: areas must be a list (got 'Alberta')"],
    ),
    "band upside down": (
        replaced("case.yaml", "[0.2, 0.8]", "[0.8, 0.2]"),
        ["case.yaml:10: tie_mode.band_Hz must be two rising frequencies above 0 (got [0.8, 0.2])"],
    ),
    "no keys": (written("case.yaml", b"- a\n"), ["case.yaml:1: must hold keys and values"]),
    "no YAML": (written("case.yaml", b"a: [\n"), ["case.yaml:2: "]),
    "missing case.yaml": (
        lambda folder: (folder / "case.yaml").unlink(),
        ["case.yaml: cannot be read"],
    ),
    "unknown sensor": (
        replaced("case.yaml", "[2, 4", "[2, 1090"),
        ["case.yaml:6: no bus '1090'; did you mean '109'?"],
    ),
    "sensor twice": (
        replaced("case.yaml", "[2, 4", "[2, 2"),
        ["case.yaml:6: sensors names bus 2 twice"],
    ),
    "tie mode of an unknown unit": (
        replaced("case.yaml", "[G34]", "[G35]"),
        ["case.yaml:8: no unit 'G35'; did you mean 'G"],
    ),
    "plot of an unknown unit": (
        added("case.yaml", "plot_unit: G0"),
        ["case.yaml:11: no unit 'G0'; did you mean 'G"],
    ),
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A copy of the shipped case to spoil."""
    return copied(tmp_path)


def test_the_copy_that_the_mistakes_start_from_is_sound(folder: Path) -> None:
    """Otherwise the refusals below could have another reason."""
    case = load_case(folder)
    assert len(case.units) == 34
    assert len(case.branches.name) == 171


@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_is_named_with_file_and_line(folder: Path, name: str) -> None:
    """A researcher with 171 branches must not search for what the program already knew."""
    change, words = MISTAKES[name]
    change(folder)
    findings = findings_of(folder)
    matching = [finding for finding in findings if all(word in finding for word in words)]
    assert len(matching) == 1, findings


ALONE = set(MISTAKES) - {
    # What these take away is missed, or contradicted, in other places, too.
    "column twice", "missing parameter column", "no slack", "PSS without an exciter",
    "unit without a name", "unit twice", "two exciters", "PSS for an unknown unit", "bus 0",
    "unknown column", "unknown key", "unknown key of the tie mode",
}  # fmt: skip


@pytest.mark.parametrize("name", sorted(ALONE))
def test_one_mistake_makes_one_finding(folder: Path, name: str) -> None:
    """A list that is long because one cell is wrong hides the cell."""
    MISTAKES[name][0](folder)
    findings = findings_of(folder)
    assert len(findings) == 1, findings


def test_all_mistakes_of_all_files_come_in_one_message(folder: Path) -> None:
    """A case with eight mistakes must not take eight attempts, whatever files they stand in."""
    names = [
        "frequency", "long line", "zero voltage", "negative tap", "zero time constant",
        "reactances out of order", "unknown model", "missing parameter column",
    ]  # fmt: skip
    for name in names:
        MISTAKES[name][0](folder)
    findings = findings_of(folder)
    for name in names:
        assert any(all(word in finding for word in MISTAKES[name][1]) for finding in findings), name


def test_a_line_that_cannot_be_read_does_not_make_its_bus_unknown(folder: Path) -> None:
    """Findings that follow from another finding send the reader to sound lines."""
    replaced("bus.csv", "\n8,", "\n8,,")(folder)
    assert findings_of(folder) == ("bus.csv:9: has 15 cells, the header 14",)


def test_a_value_for_a_parameter_that_the_model_lacks_is_refused(folder: Path) -> None:
    """A number that is read by nothing looks as if it acted."""
    path = folder / "exciter.csv"
    rows = path.read_text().splitlines()
    foreign = "TR_s"
    path.write_text(
        "\n".join([f"{rows[0]},{foreign}", f"{rows[1]},0.01"] + [r + "," for r in rows[2:]])
    )
    (finding,) = findings_of(folder)
    assert finding.startswith("exciter.csv:")
    assert foreign in finding


def test_lines_are_counted_as_an_editor_counts_them(folder: Path) -> None:
    """A finding two blank lines off points at a sound row."""
    replaced("load.csv", "\n11,", "\n\n\n11,")(folder)
    cell_of_11 = replaced("load.csv", "11,0,1", "11,0,x")
    cell_of_11(folder)
    assert findings_of(folder) == ("load.csv:5: 'p_constant_current' must be a number (got 'x')",)
