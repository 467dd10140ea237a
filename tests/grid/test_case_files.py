"""What a table may look like, and that no cell of one ends in a traceback."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from grid.spoiled import TABLES, copied
from tieline.errors import InputError, NumericalError
from tieline.grid.case import Case, load_case
from tieline.grid.check import check
from tieline.grid.settings import GridSettings
from tieline.wams.settings import WamsSettings


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A copy of the shipped case to spoil."""
    return copied(tmp_path)


def same(one: Case, other: Case) -> bool:
    """Whether two cases hold the same numbers."""
    parts = [
        (vars(getattr(one, p)), vars(getattr(other, p))) for p in ("buses", "branches", "loads")
    ]
    return (
        one.units == other.units
        and all(np.array_equal(a[key], b[key]) for a, b in parts for key in a)
        and all(
            [d.values for d in one.devices[role]] == [d.values for d in other.devices[role]]
            for role in one.devices
        )
    )


@pytest.mark.parametrize(
    "form",
    [
        lambda text: b"\xef\xbb\xbf" + text.encode(),
        lambda text: text.replace("\n", "\r\n").encode(),
        lambda text: text.replace("\n", "\r").encode(),
        lambda text: text.rstrip("\n").encode(),
        lambda text: ("\n" + text.replace("\n", "\n\n")).encode(),
        lambda text: (text + "," * text.split("\n")[0].count(",") + "\n").encode(),
        lambda text: text.replace(",", " , ").encode(),
        lambda text: text.replace("\n1,", '\n"1",').encode(),
    ],
    ids=[
        "BOM",
        "CRLF",
        "CR",
        "no last line end",
        "blank lines",
        "line of commas",
        "blanks",
        "quotes",
    ],
)
def test_what_editors_and_spreadsheets_do_to_a_table_changes_nothing(
    folder: Path, miniwecc: Case, form: Callable[[str], bytes]
) -> None:
    """A case saved from a spreadsheet is the same case."""
    for table in TABLES:
        path = folder / f"{table}.csv"
        path.write_bytes(form(path.read_text()))
    assert same(load_case(folder), miniwecc)


def test_the_order_of_the_columns_does_not_matter(folder: Path, miniwecc: Case) -> None:
    """Columns are named so that nobody has to count them."""
    for table in TABLES:
        path = folder / f"{table}.csv"
        rows = [row.split(",") for row in path.read_text().splitlines()]
        path.write_text("\n".join(",".join(reversed(row)) for row in rows))
    assert same(load_case(folder), miniwecc)


def test_a_case_may_leave_out_what_it_does_not_have(folder: Path) -> None:
    """A system without governors, stabilisers or special loads needs no empty files."""
    for name in ("load.csv", "governor.csv", "pss.csv"):
        (folder / name).unlink()
    case = load_case(folder)
    assert case.devices["governor"] == case.devices["pss"] == ()
    assert check(case, GridSettings(), WamsSettings()).controllers == ()


random_text = st.one_of(
    st.text(max_size=6),
    st.floats(allow_nan=True, allow_infinity=True).map(repr),
    st.integers(-(10**12), 10**12).map(str),
    st.sampled_from(["0", "-1", "1e308", "5e-324", "-0", '"', "\x00", "²", "1_0", "\r", "\ufeff"]),
)


@settings(
    max_examples=50, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(st.sampled_from(TABLES), st.integers(1, 35), st.integers(0, 30), random_text)
def test_no_cell_whatever_it_holds_ends_in_a_traceback(
    tmp_path_factory: pytest.TempPathFactory, table: str, line: int, column: int, text: str
) -> None:
    """Any text in any cell is a sound case, a finding or a failed power flow, nothing else."""
    folder = copied(tmp_path_factory.mktemp("fuzz"))
    path = folder / f"{table}.csv"
    rows = [row.split(",") for row in path.read_text().splitlines()]
    row = rows[line % len(rows)]
    row[column % len(row)] = text
    path.write_bytes("\n".join(",".join(row) for row in rows).encode("utf-8", "surrogatepass"))
    try:
        check(load_case(folder), GridSettings(), WamsSettings())
    except (InputError, NumericalError):
        return
