"""What a page says without a browser: words, tables, links, and nothing from elsewhere."""

import re
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from synthetic_result import CONSTANT, EXPERIMENT, SWEEP, fake_launch, plan_of
from tieline.experiment.results import read_runs
from tieline.experiment.run import execute
from tieline.report import write_pages
from tieline.report.html import data_block, element, text
from tieline.report.network_tables import controllers_table
from tieline.report.store import Store
from tieline.report.traffic_curves import put_traffic


class Links(HTMLParser):
    """Gathers every address that a page refers to or loads."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found += [value for key, value in attrs if key in ("href", "src", "action") and value]


def links_of(page: Path) -> list[str]:
    parser = Links()
    parser.feed(page.read_text(encoding="utf-8"))
    return parser.found


@pytest.fixture(scope="module")
def sweep(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("sweep")
    execute(plan_of(folder, EXPERIMENT + SWEEP), folder / "out", fake_launch)
    write_pages(folder / "out", "G34")
    return folder / "out"


def test_a_page_says_what_it_is_of(sweep: Path) -> None:
    """Otherwise nobody could say from a page which run of which version it shows."""
    page = (sweep / "points" / "0.25-s" / "report.html").read_text(encoding="utf-8")
    manifest = (sweep / "points" / "0.25-s" / "manifest.json").read_text(encoding="utf-8")
    digest = re.search(r'"config_hash": "(\w+)"', manifest)
    assert digest is not None
    for words in ("Does it hold?", digest[1], "seed", "tieline", "59.766", "G26 trips"):
        assert words in page, words


def test_a_sweeps_page_leads_to_that_of_every_point_and_back(sweep: Path) -> None:
    """Otherwise one would have to find the points' pages by hand."""
    page = sweep / "report.html"
    pages = [link for link in links_of(page) if link.endswith("report.html")]
    assert pages == ["points/ideal/report.html", "points/0.25-s/report.html"]
    for link in pages:
        assert "../../report.html" in links_of(sweep / link)
    assert "network.delay" in page.read_text(encoding="utf-8")


def test_a_page_needs_nothing_but_itself(sweep: Path) -> None:
    """Otherwise it would be empty on a train, or on another's computer."""
    for page in sweep.rglob("report.html"):
        for link in links_of(page):
            is_beside = (page.parent / link).exists()
            assert is_beside or link.startswith("#") or link == "data:,", link
        assert "@import" not in page.read_text(encoding="utf-8")


def test_the_licence_of_the_library_goes_with_it(sweep: Path) -> None:
    """Otherwise each page would break the terms under which it may hold the library."""
    assert "Permission is hereby granted" in (sweep / "report.html").read_text(encoding="utf-8")


def test_text_cannot_become_code() -> None:
    """Otherwise a label with a bracket would break the page, or run as a script."""
    bad = "</script><img src=x onerror=alert(1)>&\u2028"
    for written in (
        element("p", bad),
        element("a", "x", href=f'"{bad}'),
        data_block("d", {"a": bad}),
    ):
        assert "<img" not in written
    assert text(text("a < b")) == "a &lt; b"


def test_a_run_without_packets_has_a_page(tmp_path: Path) -> None:
    """Otherwise a study with ideal communication would end with an error."""
    words = "wams: {reporting: continuous}\nnetwork: {engine: ideal}\nsweep: []\n"
    execute(plan_of(tmp_path, EXPERIMENT + words), tmp_path / "out", fake_launch)
    page = write_pages(tmp_path / "out").read_text(encoding="utf-8")
    assert "simulates no links" in page


def test_a_run_that_failed_has_a_page_of_what_it_wrote(tmp_path: Path) -> None:
    """Otherwise one could not see how far it came, and why it ended."""
    plan = plan_of(tmp_path, EXPERIMENT, CONSTANT)
    execute(plan, tmp_path / "out", fake_launch)
    manifest = tmp_path / "out" / "manifest.json"
    broken = manifest.read_text().replace('"complete"', '"incomplete"')
    manifest.write_text(broken.replace('"reason": null', '"reason": "grid <died>"'))
    page = write_pages(tmp_path / "out").read_text(encoding="utf-8")
    assert "Incomplete: grid &lt;died&gt;" in page
    assert "Rotor speeds" in page


def test_idle_windows_of_links_keep_their_place_in_time(tmp_path: Path) -> None:
    """Otherwise a delay would be drawn where another window's was, or an idle link as busy."""
    execute(plan_of(tmp_path), tmp_path / "out", fake_launch)
    series = {
        "controller_series": {"t_s": [0.0, 0.1, 0.2, 0.3], "unit": ["G34"] * 4,
                              "delay_mean_s": [0.1, 0.2, 0.3, 0.4]},
        "link_series": {"t_s": [0.0, 0.3], "from": ["a"] * 2, "to": ["b"] * 2,
                        "utilisation": [0.5, 0.25], "max_queue": [1, 2], "dropped_queue": [0, 1],
                        "dropped_loss": [0, 0], "dropped_down": [0, 0]},
    }  # fmt: skip
    for name, columns in series.items():
        pd.DataFrame(columns).to_parquet(tmp_path / "out" / f"{name}.parquet")
    store = Store()
    put_traffic(store, read_runs(tmp_path / "out")[0])
    assert store.axes["window"] == [0.0, 0.1, 0.2, 0.3]
    lengths = {name: store.tables[name]["length"] for name in ("delay", "load", "queue")}
    assert lengths == {"delay": 4, "load": 4, "queue": 4}


def test_a_controller_that_nothing_reached_has_no_delay() -> None:
    """Otherwise the one behind a cut link would seem the fastest."""
    flows = {
        "unit": np.array(["G21", "G34"], object),
        "sent": np.array([10, 10]),
        "in_flight": np.array([0, 0]),
        "delivered": np.array([0, 10]),
        "delay_mean_s": np.array([np.nan, 0.1]),
        "delay_p95_s": np.array([np.nan, 0.2]),
        "delay_max_s": np.array([np.nan, 0.2]),
    }
    rows = str(controllers_table(flows, {}))
    assert rows.index("G21") < rows.index("G34")
    assert "0.0<" not in rows[rows.index("G21") : rows.index("G34")]
