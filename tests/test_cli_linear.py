"""`tieline modes`, `freqresp` and `damping` as a user types them."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from scenarios.study import run as run_experiment
from tieline.cli import app
from tieline.tables import read_table, units_of

RUN = CliRunner()


def invoke(*words: str) -> str:
    result = RUN.invoke(app, list(words))
    assert result.exit_code == 0, result.output
    return result.output


def test_modes_prints_a_table_and_writes_tables_and_plots(tmp_path: Path) -> None:
    """Without the files a reader could not go on from the table."""
    out = tmp_path / "out"
    text = invoke("modes", "two_area", "--pss", "none", "--out", str(out))
    assert "inter-area" in text
    assert "0.7600" in text
    assert "1 of" in text.splitlines()[-5]
    names = {path.name for path in out.iterdir()}
    assert names >= {"modes.csv", "modes.parquet", "modes.png", "shapes.csv", "shapes.png"}
    assert units_of(out / "modes.parquet")["frequency_Hz"][0] == "Hz"


def test_json_is_one_object_and_writes_nothing(tmp_path: Path, monkeypatch) -> None:
    """A script must be able to read it whole."""
    monkeypatch.chdir(tmp_path)
    data = json.loads(invoke("modes", "two_area", "--gain", "25", "--json"))
    assert data["modes_that_grow"] == 0
    assert len(data["modes"]["frequency_Hz"]) == len(data["modes"]["kind"]) > 3
    assert not list(tmp_path.iterdir())


def test_a_sweep_gives_the_locus(tmp_path: Path) -> None:
    """The root locus is the paper's main figure."""
    words = ("--gain", "25", "--beta1", "0.5", "--average", "rotor", "--sweep", "beta2=0:1:3")
    text = invoke("modes", "two_area", *words, "--out", str(tmp_path / "o"))
    assert "frequency regulation" in text
    assert len(read_table(tmp_path / "o" / "locus.parquet")) == 12


def test_a_delay_gives_the_margin(tmp_path: Path) -> None:
    """Whoever designs a loop asks how late its measurements may come."""
    words = ("--gain", "18", "--beta1", "1", "--beta2", "0", "--delay", "0.1")
    text = invoke("modes", "two_area", *words, "--out", str(tmp_path / "o"))
    assert "delay margin 0.194 s, at 2.225 Hz" in text
    assert (tmp_path / "o" / "delay.png").is_file()


def test_freqresp_gives_response_zeros_and_margins(tmp_path: Path) -> None:
    """One line for the paper's Bode plots."""
    out = tmp_path / "o"
    words = ("--unit", "G1", "--beta1", "1", "--beta2", "0.5", "--delay", "0", "--delay", "0.5")
    text = invoke("freqresp", "two_area", *words, "--out", str(out))
    assert "delay 0 s:" in text
    assert {path.name for path in out.iterdir()} >= {
        "response.parquet", "zeros.csv", "compensation.csv", "bode.png", "nyquist.png", "zeros.png",
    }  # fmt: skip
    assert set(read_table(out / "response.parquet")["delay_s"]) == {0.0, 0.5}


def test_damping_follows_a_result(tmp_path: Path) -> None:
    """The unit beside a trip is braked, and D(t) says so."""
    folder = tmp_path / "r"
    run_experiment("g26_trip_smoke", folder, "federation.core=local")
    data = json.loads(invoke("damping", str(folder), "--unit", "G23", "--json"))
    assert data["extremes"]["unit"] == ["G23"]
    assert data["extremes"]["least_pu"][0] < -0.05
    # At rest the machine's own D is all there is.
    assert data["damping"]["D_pu.G23"][0] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("modes", "two_areas"), "two_area"),
        (("modes", "two_area", "--sweep", "beta1=0:1"), "--sweep must be NAME=FIRST:LAST:POINTS"),
        (("modes", "two_area", "--sweep", "beta9=0:1:3"), "no sweep over 'beta9'"),
        (("modes", "two_area", "--delay", "-1"), "delays_s must be"),
        (("modes", "two_area", "--average", "rotors"), "average must be one of sensor, rotor"),
        (("freqresp", "two_area", "--unit", "G7"), "G7"),
        (("freqresp", "two_area", "--unit", "G1", "--band", "3:1"), "--band must be LOW:HIGH"),
        (("damping", "nowhere"), "nowhere"),
    ],
)
def test_bad_input_is_refused_with_what_is_allowed(words: tuple[str, ...], message: str) -> None:
    """A traceback tells a user nothing."""
    result = RUN.invoke(app, list(words))
    assert result.exit_code == 2
    assert message in result.output
