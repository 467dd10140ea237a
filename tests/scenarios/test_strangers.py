"""A federate of somebody else's that sends noise to every endpoint of a run.

stranger -> grid/bundle, network/bundle, grid/modulation, network/packets
"""

import sys
from pathlib import Path

import pytest

from cosim.stranger import ANYWHERE, OWN_WORDS, ROUNDS, TARGETS, payloads
from scenarios.study import run
from tieline.experiment.results import Run
from tieline.logs import records

SCRIPT = Path(__file__).parents[1] / "cosim" / "stranger.py"
EXPERIMENT = f"""\
name: strangers
question: Does noise from a federate that nobody checked change a bit?
case: miniwecc
seed: 1
grid:
  duration: 0.2 s
  pss: {{model: generalized, gain: 9, beta1: 1, beta2: 0.5}}
  events: [{{at: 0.05 s, trip_generator: G26}}]
network: {{engine: constant, delay: 30 ms}}
federation:
  hang_timeout: 60 s
  guests:
    - name: stranger
      command: {sys.executable} {SCRIPT} {{config}}
      units: [G34]
"""
ALONE = ("federation.guests=[]", "federation.core=local")


@pytest.fixture(scope="module")
def disturbed(tmp_path_factory: pytest.TempPathFactory) -> Run:
    folder = tmp_path_factory.mktemp("strangers")
    (folder / "experiment.yaml").write_text(EXPERIMENT)
    return run(str(folder / "experiment.yaml"), folder / "r")


@pytest.mark.helics
def test_noise_at_every_endpoint_changes_no_bit_of_a_run(disturbed: Run, tmp_path: Path) -> None:
    """If it did, whoever joins a federation could move its results without a trace."""
    (tmp_path / "experiment.yaml").write_text(EXPERIMENT)
    alone = run(str(tmp_path / "experiment.yaml"), tmp_path / "r", *ALONE)
    assert disturbed.is_complete
    hashes = dict(disturbed.manifest["tables"])
    assert hashes.pop("modulation.parquet")
    assert hashes == alone.manifest["tables"]
    assert alone.manifest["dropped_messages"] == {}


@pytest.mark.helics
def test_every_message_that_was_dropped_is_counted_by_endpoint_and_sender(disturbed: Run) -> None:
    """If not, a run that was disturbed would look like one that was left alone."""
    dropped = disturbed.manifest["dropped_messages"]
    # The payloads, one from the past and one with forged names; what is stamped with the year to
    # come never comes.
    each = ROUNDS * (len(list(payloads(0))) + 2)
    assert set(dropped) == set(TARGETS)
    for target in TARGETS:
        assert dropped[target][ANYWHERE] == each, target
    assert dropped["grid/modulation"]["stranger/G34"] == ROUNDS * len(OWN_WORDS)


@pytest.mark.helics
def test_the_log_tells_the_first_of_them_and_the_sum(disturbed: Run) -> None:
    """If not, nobody could find out who disturbs; if it told all, it would grow without end."""
    lines = [record.message for record in records(disturbed.folder) if record.process == "grid"]
    log = "\n".join(lines)
    told = [line for line in lines if "grid/bundle dropped a message" in line]
    assert len(told) == 5
    assert "of 'stranger/any': only network/bundle may send there; 100 bytes, which begin" in log
    assert "grid/bundle has dropped" in log
