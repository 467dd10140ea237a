"""What strangers send is counted in memory that does not grow, and told a few times only."""

import json
from pathlib import Path

from tieline.cosim.strangers import WARNINGS, Strangers, dropped_messages


def test_the_first_messages_are_told_and_all_are_counted(tmp_path: Path) -> None:
    """A flood must not fill the log, nor pass unnoticed."""
    log: list[str] = []
    strangers = Strangers("grid", log.append)
    for number in range(100):
        strangers.drop("grid/bundle", f"x/{number % 3}", bytes([number]) * 40, "not asked")
    assert len(log) == WARNINGS + 1
    assert log[0].startswith("warning: grid/bundle dropped a message of 'x/0': not asked; 40 bytes")
    assert strangers.counts == {"grid/bundle": {"x/0": 34, "x/1": 33, "x/2": 33}}
    strangers.save(tmp_path)
    assert "34 of 'x/0'" in log[-1]
    assert dropped_messages(tmp_path) == strangers.counts


def test_ever_new_names_do_not_fill_the_memory() -> None:
    """A stranger may call itself as it likes, a thousand times."""
    strangers = Strangers("grid", lambda line: None)
    for number in range(1_000):
        strangers.drop("grid/bundle", f"{number}" * 100, b"", "not asked")
    counts = strangers.counts["grid/bundle"]
    assert len(counts) == 21
    assert max(map(len, counts)) <= 60
    assert sum(counts.values()) == 1_000


def test_a_federate_that_dropped_nothing_leaves_no_file(tmp_path: Path) -> None:
    """A file that is always there says nothing by being there."""
    Strangers("grid").save(tmp_path)
    assert list(tmp_path.iterdir()) == []
    assert dropped_messages(tmp_path) == {}


def test_each_federates_counts_are_put_together(tmp_path: Path) -> None:
    """Grid and network count apart, and a result has one list."""
    for name in ("grid", "network"):
        strangers = Strangers(name, lambda line: None)
        strangers.drop(f"{name}/bundle", "x", b"", "not asked")
        strangers.save(tmp_path)
    assert dropped_messages(tmp_path) == {"grid/bundle": {"x": 1}, "network/bundle": {"x": 1}}
    assert json.loads((tmp_path / "grid.strangers.json").read_text()) == {"grid/bundle": {"x": 1}}
