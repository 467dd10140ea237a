"""The sides of one run, each with its own launcher, on the loopback interface and with dummies."""

import dataclasses
import os
import signal
import threading
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from cosim.dummy import COMMANDS, write_run
from synthetic_result import plan_of
from tieline.cosim.interfaces import FEDERATES
from tieline.cosim.ports import reserved_port
from tieline.errors import CosimError, InputError, TielineError
from tieline.experiment.desk import connect, hello, refusal
from tieline.experiment.gather import GatheredIncompleteError, gather
from tieline.experiment.hosts import check_address, check_key, join, serve
from tieline.experiment.keys import KEY_VARIABLE, given_key
from tieline.experiment.launch import launch
from tieline.experiment.plan import PlannedRun
from tieline.experiment.results import read_manifest
from tieline.experiment.watch import Progress

ENDLESS = 100_000
WAIT_S = 30.0
KEY = "not-to-be-guessed-by-anyone"


def planned(folder: Path, intervals: int = 20, core: str = "zmq") -> PlannedRun:
    """Return a run of dummies."""
    folder.mkdir(parents=True, exist_ok=True)
    (own,) = plan_of(folder).runs
    clock = {"rate_hz": 60, "intervals": intervals, "lead": 0}
    pauses = {name: {"pause_s": 0.02} for name in FEDERATES}
    federation = {"core": core}
    run = dict(own.run) | {"clock": clock, "dummy": pauses, "federation": federation}
    return dataclasses.replace(own, run=run)


class Sides:
    """Broker, grid and network on threads; what each raised stands in `raised`."""

    def __init__(self, folder: Path, run: PlannedRun, **keys: str) -> None:
        self.keys = keys
        self.raised: dict[str, TielineError] = {}
        self.folders = {name: folder / name for name in FEDERATES}
        self._run = run
        self.wait_s = WAIT_S

    def run(self, on_progress: Callable[[Progress], None] | None = None) -> None:
        """Run all three to their end."""
        with reserved_port() as port:
            calls: dict[str, Callable[[], Any]] = {
                "broker": lambda: serve(
                    self._run,
                    "127.0.0.1",
                    port,
                    self.wait_s,
                    lambda _: None,
                    on_progress,
                    self.keys.get("broker"),
                )
            }
            for name, folder in self.folders.items():
                calls[name] = lambda name=name, folder=folder: join(
                    self._run,
                    name,
                    ("127.0.0.1", port),
                    folder,
                    WAIT_S,
                    lambda _: None,
                    COMMANDS,
                    self.keys.get(name),
                )
            threads = [threading.Thread(target=self._call, args=item) for item in calls.items()]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()

    def _call(self, name: str, function: Callable[[], Any]) -> None:
        try:
            function()
        except TielineError as error:
            self.raised[name] = error


@pytest.mark.helics
def test_three_launchers_give_the_bytes_of_one(tmp_path: Path) -> None:
    """If not, a run on several hosts would be another experiment."""
    sides = Sides(tmp_path, planned(tmp_path / "plan"))
    sides.run()
    assert sides.raised == {}
    write_run(tmp_path / "local", "local", 20, {})
    launch(tmp_path / "local", commands=COMMANDS)
    for name, folder in sides.folders.items():
        digest = (folder / f"{name}.digest").read_text()
        assert digest == (tmp_path / "local" / f"{name}.digest").read_text()
        assert read_manifest(folder)["status"] == "incomplete"


@pytest.mark.helics
def test_sides_with_one_key_run_as_without(tmp_path: Path) -> None:
    """If not, nobody would use a key: HELICS's own is derived from it on each side."""
    sides = Sides(tmp_path, planned(tmp_path / "plan"), broker=KEY, grid=KEY, network=KEY)
    sides.run()
    assert sides.raised == {}
    for name, folder in sides.folders.items():
        assert (folder / f"{name}.digest").is_file()
    # What is kept of the run must not give the key away.
    for path in tmp_path.rglob("*"):
        assert path.is_dir() or KEY.encode() not in path.read_bytes(), path


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"broker": KEY, "grid": KEY[::-1]}, "has not the key given here"),
        ({"broker": KEY}, "it has no key, and the broker asks for one"),
        ({"grid": KEY}, "it has a key, and the broker has none"),
    ],
)
def test_who_has_another_key_does_not_come_in(
    keys: dict[str, str], words: str, tmp_path: Path
) -> None:
    """If not, whoever reaches the port could feed measurements of their own into the run."""
    sides = Sides(tmp_path, planned(tmp_path / "plan"), **keys)
    sides.folders = {"grid": tmp_path / "grid"}
    sides.wait_s = 1.0
    sides.run()
    assert words in str(sides.raised["grid"])
    assert "did not come" in str(sides.raised["broker"])
    assert not (tmp_path / "grid").exists()


def test_a_key_that_others_may_know_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """If not, a broker open to the network would be as good as without a key."""
    path = tmp_path / "key"
    path.write_text(f"{KEY}\n")
    path.chmod(0o644)
    with pytest.raises(InputError, match="chmod 600"):
        given_key(path)
    path.chmod(0o600)
    assert given_key(path) == KEY
    monkeypatch.setenv(KEY_VARIABLE, "short")
    with pytest.raises(InputError, match="at least 16"):
        given_key(None)
    monkeypatch.delenv(KEY_VARIABLE)
    assert given_key(None) is None
    with pytest.raises(InputError, match="needs a key"):
        check_key("192.0.2.1", None)
    check_key("192.0.2.1", KEY)
    check_key("127.0.0.1", None)


@pytest.mark.helics
def test_the_death_of_one_side_ends_the_others_with_its_name(tmp_path: Path) -> None:
    """If not, two hosts would compute or wait for nothing all night."""
    sides = Sides(tmp_path, planned(tmp_path / "plan", ENDLESS))
    killed_s: list[float] = []

    def kill(progress: Progress) -> None:
        if progress.federate == "network" and progress.k >= 1 and not killed_s:
            killed_s.append(time.monotonic())
            os.kill(int((tmp_path / "network" / "network.pid").read_text()), signal.SIGKILL)

    sides.run(kill)
    assert time.monotonic() - killed_s[0] < 15
    assert set(sides.raised) == {"broker", "grid", "network"}
    for error in sides.raised.values():
        assert "network: died: killed by SIGKILL" in str(error)
    assert (tmp_path / "grid" / "grid.aborted").exists()
    with pytest.raises(GatheredIncompleteError, match=r"network: left no word|grid: "):
        gather(list(sides.folders.values()), tmp_path / "result")
    assert read_manifest(tmp_path / "result")["status"] == "incomplete"


@pytest.mark.helics
def test_a_side_whose_host_goes_away_is_named(tmp_path: Path) -> None:
    """If not, a computer switched off would leave the broker waiting."""
    run = planned(tmp_path / "plan")
    raised: list[TielineError] = []

    def broker(port: int) -> None:
        try:
            serve(run, "127.0.0.1", port, WAIT_S, lambda _: None)
        except TielineError as error:
            raised.append(error)

    with reserved_port() as port:
        thread = threading.Thread(target=broker, args=(port,))
        thread.start()
        grid, network = (connect("127.0.0.1", port, WAIT_S) for _ in FEDERATES)
        with closing(grid):
            for wire, name in ((grid, "grid"), (network, "network")):
                wire.send(hello(run, name))
                assert wire.wait(WAIT_S) == {"accepted": name}
            assert "go" in grid.wait(WAIT_S)
            network.close()
            assert "network: gone: the connection ended" in grid.wait(WAIT_S)["end"]
        thread.join()
    assert "network: gone: the connection ended" in str(raised[0])


def wait_in_vain(run: PlannedRun, port: int, say: Callable[[str], None]) -> None:
    with pytest.raises(CosimError, match="grid and network did not come"):
        serve(run, "127.0.0.1", port, 1.0, say)


def test_who_has_another_run_or_release_is_refused_with_both_named(tmp_path: Path) -> None:
    """If not, two hosts would simulate two experiments and call them one."""
    own = planned(tmp_path / "own")
    other = dataclasses.replace(own, run=dict(own.run) | {"config_hash": "f" * 64})
    told: list[str] = []
    with reserved_port() as port:
        thread = threading.Thread(target=wait_in_vain, args=(own, port, told.append))
        thread.start()
        with pytest.raises(InputError, match="refused: grid is of another run or version") as error:
            join(other, "grid", ("127.0.0.1", port), tmp_path / "out", WAIT_S, told.append)
        thread.join()
    words = f"config {'f' * 12} there, {str(own.run['config_hash'])[:12]} at the broker"
    assert words in str(error.value)
    assert any(words in line for line in told)
    assert not (tmp_path / "out").exists()
    older = hello(own, "grid") | {"tieline": "0.0.9"}
    assert "tieline 0.0.9 there, 0." in str(refusal(hello(own, "grid"), older))
    assert refusal(hello(own, "grid"), hello(own, "grid")) is None


@pytest.mark.parametrize("host", ["192.0.2.1", "a.host.example"])
def test_an_address_that_others_can_reach_must_be_asked_for(host: str) -> None:
    """HELICS asks nobody who they are; a broker must not be open by accident."""
    with pytest.raises(InputError, match="--allow-remote"):
        check_address(host, False)
    check_address(host, True)
    check_address("127.0.0.1", False)
    with pytest.raises(InputError, match="no address"):
        check_address("0.0.0.0", True)


def test_folders_of_two_runs_do_not_become_one_result(tmp_path: Path) -> None:
    """If not, the grid of one experiment could be shown with the network of another."""
    from tieline.experiment.export import lay_out

    run = planned(tmp_path / "plan")
    lay_out(run, tmp_path / "a")
    other = dataclasses.replace(run, run=dict(run.run) | {"config_hash": "f" * 64})
    lay_out(other, tmp_path / "b")
    with pytest.raises(InputError, match="not of one run: their config_hash differ"):
        gather([tmp_path / "a", tmp_path / "b"], tmp_path / "result")
    with pytest.raises(GatheredIncompleteError, match="grid and network: left no word"):
        gather([tmp_path / "a"], tmp_path / "result")
