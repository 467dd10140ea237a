"""Who is named when a run fails, judged from words and process states alone."""

from dataclasses import dataclass

import pytest

from tieline.cosim.guests import GuestSettings
from tieline.cosim.interfaces import FederationSettings
from tieline.experiment.watch import LONG_S, PATIENCE, Effort, Progress, Suspect, Watch


@dataclass
class FakeProcess:
    """A process in a state that the test chooses."""

    exit_code: int | None = None
    is_held: bool = False
    reason: str | None = None
    works: bool | None = None
    """None: the kernel does not tell."""
    passed_s: float = 0.0

    def is_stopped(self) -> bool:
        """Return whether it is held."""
        return self.is_held

    def effort(self) -> Effort | None:
        """Return processor time for as long as it is said to have worked."""
        return None if self.works is None else Effort(self.works * self.passed_s, 0)


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


def silence(
    watch: Watch, works: bool, seconds: float, guest: FakeProcess | None = None
) -> Suspect | None:
    """Return who is suspected first in a silence in which the federates' processes work, or not."""
    everyone = {name: FakeProcess(works=works) for name in ("broker", "grid", "network")}
    everyone |= {} if guest is None else {"visitor": guest}
    for _ in range(round(seconds / 0.1)):
        watch.pass_time(0.1)
        for process in everyone.values():
            process.passed_s += 0.1
        suspect = watch.suspect(everyone)
        if suspect is not None:
            return suspect
    return None


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


def met_after(seconds: float) -> Watch:
    """Return a watch of a run of which one meeting took so long."""
    watch = watch_of(word("grid"), word("network"))
    let_pass(watch, seconds)
    watch.hear(word("grid", k=6))
    return watch


def test_a_run_whose_meetings_take_long_is_given_longer_while_it_works() -> None:
    """If not, a large network would be ended in the middle of honest work."""
    watch = met_after(1.9)
    suspect = silence(watch, True, 20.0)
    assert "no federate was granted anything for 9.5 s" in str(suspect)
    assert watch.silence_s == pytest.approx(1.9 * PATIENCE, abs=0.2)


def test_a_run_whose_meetings_are_short_is_given_no_more_than_the_limit() -> None:
    """If not, an endless loop in a federate would hold a run for minutes."""
    assert silence(met_after(0.2), True, 1.9) is None
    assert silence(met_after(0.2), True, 2.3) is not None


def test_a_run_in_which_nobody_works_is_given_the_limit_whatever_it_was_like() -> None:
    """If not, a federation that waits for itself would hold a run whose meetings take long."""
    suspect = silence(met_after(1.9), False, 2.5)
    assert suspect is not None
    assert "for 2 s of wall time, and no process worked" in suspect.reason


@pytest.mark.parametrize(("state", "k"), [("running", 0), ("finishing", 9)])
def test_work_that_nobody_hears_of_counts_where_there_is_no_meeting_to_learn_from(
    state: str, k: int
) -> None:
    """If not, compiled code that lets no other thread speak would end a good run."""
    words = [word(name, state, k=k) for name in ("grid", "network")]
    assert silence(watch_of(*words), True, 20.0) is None
    assert LONG_S > 20.0
    assert silence(watch_of(*words), False, 2.5) is not None


def test_a_start_in_which_nobody_works_is_over_soon() -> None:
    """If not, a federate that never starts would be waited for as long as one that compiles."""
    words = (word("grid", "joining", k=-1), word("network", "opening", k=-1))
    suspect = silence(watch_of(*words), False, 2.5)
    assert suspect is not None
    assert suspect.name == "network"


@pytest.mark.parametrize(("works", "limit_s"), [(False, 2.0), (True, 5.0), (None, 5.0)])
def test_a_guest_that_does_not_join_is_waited_for_only_while_it_works(
    works: bool | None, limit_s: float
) -> None:
    """If not, a slip in its command line would hold the run, or a slow program would be cut off."""
    visitor = GuestSettings(name="visitor", command="visit {config}")
    settings = FederationSettings(hang_timeout=2.0, start_timeout=5.0, guests=(visitor,))
    watch = Watch(settings)
    for name in ("grid", "network"):
        watch.hear(word(name, "joining", k=-1))
    guest = FakeProcess(works=works)
    assert silence(watch, False, limit_s - 0.2, guest) is None
    suspect = silence(watch, False, 0.5, guest)
    assert named(suspect) == "visitor"
    assert "has not joined the federation" in str(suspect)


def test_waiting_for_others_to_join_is_no_work() -> None:
    """If not, the processor time of HELICS's own looking around would hold a start for 30 s."""
    watch = watch_of(word("grid", "joining", k=-1), word("network", "opening", k=-1))
    looking, idle = FakeProcess(works=True), FakeProcess(works=False)
    everyone = {"broker": idle, "grid": looking, "network": idle}
    suspect = None
    for _ in range(25):
        watch.pass_time(0.1)
        looking.passed_s += 0.1
        suspect = suspect or watch.suspect(everyone)
    assert named(suspect) == "network"


def test_a_stopped_process_is_named_before_the_limit_of_a_long_run() -> None:
    """If not, a run with long meetings would wait for a process that cannot work."""
    watch = Watch(FederationSettings(hang_timeout=60.0))
    let_pass(watch, 3.2)
    assert named(watch.suspect(processes(broker=FakeProcess(is_held=True)))) == "broker"


def test_a_process_without_grants_of_its_own_is_told_with_those_of_the_others() -> None:
    """If not, nobody would know how far a run came whose broker died."""
    watch = watch_of(word("grid"), word("network", granted_ns=1))
    suspect = watch.suspect(processes(broker=FakeProcess(-9)))
    assert suspect is not None
    assert suspect.reason == "died: killed by SIGKILL (last granted 0.083335 s to the others)"


def test_a_federates_word_is_progress_and_the_brokers_is_not() -> None:
    """If not, the progress bar would follow the broker."""
    watch = watch_of()
    assert watch.hear({"federate": "broker", "state": "running"}) is None
    assert watch.hear(word("grid")) == Progress("grid", "running", 5, 83_335_333)
    assert watch.granted_ns() == {"grid": 83_335_333, "network": -1}
