"""Who is named when a run fails, judged from words and process states alone."""

from dataclasses import dataclass

import pytest

from tieline.cosim.interfaces import FederationSettings
from tieline.experiment.watch import Progress, Suspect, Watch


@dataclass
class FakeProcess:
    """A process in a state that the test chooses."""

    exit_code: int | None = None
    is_held: bool = False
    reason: str | None = None

    def is_stopped(self) -> bool:
        """Return whether it is held."""
        return self.is_held


def processes(**changed: FakeProcess) -> dict[str, FakeProcess]:
    """Return broker, grid and network, alive unless said otherwise."""
    return {name: changed.get(name, FakeProcess()) for name in ("broker", "grid", "network")}


def word(federate: str, state: str = "running", **more: object) -> dict[str, object]:
    """Return one status line."""
    line = {"federate": federate, "state": state, "k": 5, "granted_ns": 83_335_333, "cpu_s": 1.0}
    return {**line, "waits": False, **more}


def watch_of(*words: dict[str, object]) -> Watch:
    """Return a watch that has heard these words."""
    watch = Watch(FederationSettings(hang_timeout=2.0, start_timeout=5.0))
    for one in words:
        watch.hear(one)
    return watch


def let_pass(watch: Watch, seconds: float) -> None:
    """Let wall time pass in small steps."""
    for _ in range(round(seconds / 0.1)):
        watch.pass_time(0.1)


def failed(federate: str, fault: str) -> dict[str, object]:
    """Return the last word of a federate that failed."""
    return word(federate, "failed", reason="it broke", fault=fault, exit_code=3)


def named(suspect: Suspect | None) -> str:
    """Return the name of a suspect."""
    assert suspect is not None
    return suspect.name


def test_nobody_is_suspected_while_both_run() -> None:
    """If not, good runs would be ended."""
    assert watch_of(word("grid"), word("network")).suspect(processes()) is None


def test_the_one_whose_own_fault_it_is_is_named_before_its_victim() -> None:
    """If not, the report would send the user to the wrong federate."""
    watch = watch_of(failed("grid", "other"), failed("network", "own"))
    suspect = watch.suspect(processes())
    assert suspect == Suspect("network", "it broke (last granted 0.083335 s)", 3)


def test_a_killed_process_is_named_before_the_one_that_lost_it() -> None:
    """If not, a crash would be put down to its victim."""
    watch = watch_of(failed("grid", "other"), word("network"))
    suspect = watch.suspect(processes(network=FakeProcess(-9), grid=FakeProcess(4)))
    assert suspect is not None
    assert suspect.name == "network"
    assert suspect.reason == "died: killed by SIGKILL (last granted 0.083335 s)"


def test_a_stopped_process_is_named_as_soon_as_the_other_lost_it() -> None:
    """If not, the report would name the one that still worked."""
    watch = watch_of(failed("grid", "other"), word("network"))
    assert named(watch.suspect(processes(network=FakeProcess(is_held=True)))) == "network"


def test_a_victim_alone_is_only_an_uncertain_suspect() -> None:
    """If not, the run would be judged before the culprit's word is heard."""
    suspect = watch_of(failed("grid", "other"), word("network")).suspect(processes())
    assert suspect is not None
    assert not suspect.is_certain


def test_a_process_that_ends_well_before_its_federate_finished_is_named() -> None:
    """If not, a federate that left early would let the run hang."""
    watch = watch_of(word("grid"), word("network"))
    assert named(watch.suspect(processes(grid=FakeProcess(0)))) == "grid"
    assert named(watch.suspect(processes(broker=FakeProcess(0)))) == "broker"


def test_a_broker_may_end_while_the_federates_write_their_results() -> None:
    """If not, slow disks would fail good runs."""
    watch = watch_of(word("grid", "finishing"), word("network", "finished"))
    assert watch.suspect(processes(broker=FakeProcess(0), network=FakeProcess(0))) is None


def test_the_federate_whose_turn_it_is_is_named_when_nothing_moves() -> None:
    """If not, the one that waits rightly would be blamed for the one that hangs."""
    watch = watch_of(word("grid", k=4, granted_ns=1, waits=True), word("network"))
    let_pass(watch, 1.9)
    assert watch.suspect(processes()) is None
    let_pass(watch, 0.2)
    suspect = watch.suspect(processes())
    assert named(suspect) == "network"
    assert "no federate was granted anything for 2 s" in str(suspect)


def test_a_grant_is_a_sign_of_life_and_a_repeated_word_is_none() -> None:
    """If not, heartbeats of a hung federate would keep the run alive for ever."""
    watch = watch_of(word("grid"), word("network"))
    let_pass(watch, 1.5)
    watch.hear(word("grid", cpu_s=2.0))
    assert watch.silence_s == pytest.approx(1.5)
    watch.hear(word("grid", k=6))
    assert watch.silence_s == 0.0


@pytest.mark.parametrize(("state", "k"), [("opening", -1), ("running", 0), ("finishing", 9)])
def test_processor_time_counts_where_code_is_compiled_or_results_are_written(
    state: str, k: int
) -> None:
    """If not, the first run on a machine would be ended while it compiles."""
    watch = watch_of(word("grid", state, k=k), word("network"))
    let_pass(watch, 1.5)
    watch.hear(word("grid", state, k=k, cpu_s=1.01))
    assert watch.silence_s > 1.0
    watch.hear(word("grid", state, k=k, cpu_s=1.5))
    assert watch.silence_s == 0.0


def test_a_federate_that_never_joins_is_named_after_the_start_timeout() -> None:
    """If not, a run would wait for it without end."""
    watch = watch_of(word("grid", "joining"), word("network", "opening"))
    let_pass(watch, 4.9)
    assert watch.suspect(processes()) is None
    let_pass(watch, 0.2)
    suspect = watch.suspect(processes())
    assert named(suspect) == "network"
    assert "has not joined the federation for 5 s" in str(suspect)


def test_a_launcher_that_was_held_itself_does_not_blame_the_federates() -> None:
    """If not, Ctrl-Z and fg, or a suspended laptop, would fail the run."""
    watch = watch_of(word("grid"), word("network"))
    watch.pass_time(3600.0)
    assert watch.suspect(processes()) is None


def test_a_federates_word_is_progress_and_the_brokers_is_not() -> None:
    """If not, the progress bar would follow the broker."""
    watch = watch_of()
    assert watch.hear({"federate": "broker", "state": "running"}) is None
    assert watch.hear(word("grid")) == Progress("grid", "running", 5, 83_335_333)
    assert watch.granted_ns() == {"grid": 83_335_333, "network": -1}
