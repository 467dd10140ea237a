"""The page of a real run, looked at in a real browser: Chromium without a window.

tieline run ... -> report.html -> Chromium <- keys and pointer
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from report.chromium import Browser, chromium, executable
from scenarios.study import run
from tieline.report import write_pages

pytestmark = [
    pytest.mark.chromium,
    pytest.mark.skipif(executable() is None, reason="no Chromium is installed"),
]

CUT = "network.events=[{at: 1.2 s, event: link_down, link: [S101, S105]}]"
MOST_BYTES = 15_000_000
END, HOME, RIGHT = ("End", 35), ("Home", 36), ("ArrowRight", 39)

FILLS = "[...document.querySelectorAll('{}')].map(part => part.style.{})"
STATIONS = FILLS.format("#drawing-run .stations circle", "fill")
UNITS = FILLS.format("#drawing-run .unit", "fill")
LINKS = FILLS.format("#drawing-run .links .link", "stroke")
CLOCK = "document.getElementById('clock').textContent"
DOWN = "document.querySelectorAll('#drawing-run .links .down').length"


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the page of 1.5 s of the trip of G26, with a link cut on the way."""
    folder = tmp_path_factory.mktemp("drawn") / "out"
    run("g26_trip_smoke", folder, "grid.duration=1.5 s", "federation.core=local", CUT)
    return write_pages(folder)


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    with chromium(tmp_path_factory.mktemp("profile")) as found:
        yield found


@pytest.fixture
def opened(browser: Browser, page: Path) -> Browser:
    browser.open(page)
    return browser


def replayed(opened: Browser, *keys: tuple[str, int]) -> dict[str, Any]:
    """Return what the drawing shows after keys on the slider."""
    opened.run("document.getElementById('time').focus()")
    for key in keys:
        opened.press(*key)
    parts = {"stations": STATIONS, "units": UNITS, "links": LINKS, "clock": CLOCK, "down": DOWN}
    return {name: opened.run(script) for name, script in parts.items()}


def test_everything_is_drawn_without_a_complaint_or_a_request(opened: Browser, page: Path) -> None:
    """Otherwise a reader would see gaps, or a page that needs a network would pass for whole."""
    opened.run("tieline.drawAll().then(() => 1)")
    charts = opened.run(
        "[...document.querySelectorAll('.chart')].map(c => [c.dataset.name, c.dataset.drawn,"
        " c.querySelectorAll('canvas').length])"
    )
    assert len(charts) >= 13
    assert all(drawn == ["yes", 1] for _, *drawn in charts), charts
    assert {"speed", "vt", "wbar", "vs", "age", "histogram", "queue", "dropped_so_far"} <= {
        name for name, *_ in charts
    }
    assert opened.errors == []
    assert opened.asked == [page.as_uri()]
    assert page.stat().st_size < MOST_BYTES


def test_the_charts_hold_ink(opened: Browser) -> None:
    """Otherwise a canvas of the right size could be empty."""
    opened.run("tieline.drawAll().then(() => 1)")
    colours = opened.run(
        "[...document.querySelectorAll('.chart canvas')].map(c => new Set(new Uint32Array("
        "c.getContext('2d').getImageData(0, 0, c.width, c.height).data.buffer)).size)"
    )
    assert min(colours) > 5, colours


def test_the_drawing_has_every_station_line_link_and_unit(opened: Browser) -> None:
    """Otherwise a part of the interconnection would be missing from the picture."""
    counts = opened.run(
        "['stations circle', 'lines line', 'links .link', 'units .unit'].map(part =>"
        " document.querySelectorAll('#drawing-run .' + part).length)"
    )
    assert counts == [58, 90, 180, 34]
    apart = opened.run(
        "(() => { const all = [...document.querySelectorAll('#drawing-run .stations circle')].map("
        "c => [+c.getAttribute('cx'), +c.getAttribute('cy')]); return Math.min(...all.flatMap("
        "(a, i) => all.slice(0, i).map(b => Math.hypot(a[0] - b[0], a[1] - b[1])))); })()"
    )
    assert apart > 13, "two stations cover each other"


def test_the_slider_moves_the_drawing(opened: Browser) -> None:
    """Otherwise the replay would show one instant for all."""
    start, end = replayed(opened, HOME), replayed(opened, END)
    assert (start["clock"], end["clock"]) == ("0.00 s", "1.50 s")
    assert (start["down"], end["down"]) == (0, 2)
    for part in ("stations", "units", "links"):
        assert start[part] != end[part], part
    assert replayed(opened, HOME, RIGHT)["clock"] == "0.05 s"


def test_the_numbers_beside_the_drawing_are_the_runs(opened: Browser, page: Path) -> None:
    """Otherwise the read-outs could be those of another instant, or of another unit."""
    import pandas as pd

    replayed(opened, END)
    words = opened.run("document.querySelector('.now').innerText").replace("\n", " ")
    grid = pd.read_parquet(page.parent / "grid.parquet")
    assert f"{60 * grid['coi_pu'].iloc[-1]:.3f} Hz" in words
    links = pd.read_parquet(page.parent / "links.parquet")
    dropped = int(links[["dropped_queue", "dropped_loss", "dropped_down"]].sum().sum())
    assert dropped > 0
    assert f"{dropped} packets" in words
    assert "S101-S105 down" in opened.run("document.querySelector('.happened').textContent")


def test_play_runs_to_the_end_and_stops(opened: Browser) -> None:
    """Otherwise the button would do nothing, or go on for ever."""
    opened.run("document.getElementById('play').click()")
    opened.run(
        "new Promise(done => { const look = () => tieline.replay.isPlaying ?"
        " setTimeout(look, 20) : done(1); look(); })"
    )
    assert opened.run(CLOCK) == "1.50 s"
    assert "Play" in opened.run("document.getElementById('play').textContent")


def test_dragging_over_one_chart_zooms_all_in_time(opened: Browser) -> None:
    """Otherwise speeds and voltages of one second could not be read side by side."""
    opened.run("tieline.drawAll().then(() => 1)")
    box = opened.run(
        "(() => { const over = document.querySelector('#chart-speed .u-over');"
        " over.scrollIntoView({block: 'center'}); const r = over.getBoundingClientRect();"
        " return [r.left, r.top, r.width, r.height]; })()"
    )
    left, top, width, height = box
    middle = top + height / 2
    opened.drag((left + 0.2 * width, middle), (left + 0.6 * width, middle))
    ranges = opened.run(
        "['speed', 'vt', 'age', 'histogram'].map(name => {"
        " const {min, max} = tieline.charts.shown.get(name).chart.scales.x; return [min, max]; })"
    )
    # A pixel is some milliseconds of the 1.5 s.
    for low, high in ranges[:3]:
        assert (low, high) == (pytest.approx(0.3, abs=0.02), pytest.approx(0.9, abs=0.02))
    assert ranges[3][0] > 10, "delays are no times"
    # Charts that told each other of the zoom for ever once kept the page busy.
    opened.run(
        "tieline.charts.shown.get('vt').chart.hooks.draw = [() => tieline.times++];"
        " tieline.times = 0; new Promise(done => setTimeout(done, 100))"
    )
    assert opened.run("tieline.times") == 0


def test_a_unit_chosen_in_the_drawing_stands_out_in_the_charts(opened: Browser) -> None:
    """Otherwise one of 34 curves could not be followed from chart to chart."""
    opened.run("tieline.drawAll().then(() => 1)")
    opened.run(
        "document.querySelector('[aria-label=\"unit G34\"]').dispatchEvent(new Event('click'))"
    )
    assert opened.run("document.getElementById('highlight').value") == "G34"
    chips = opened.run("document.querySelector('#chart-vt .chip.strong').textContent")
    assert chips == "G34"
    is_same = opened.run(
        "(() => { const {chart, spec} = tieline.charts.shown.get('vt');"
        " const row = spec.curves.findIndex(c => c.unit === 'G34') + 1;"
        " return chart.data.at(-1).every((v, i) => v === chart.data[row][i]); })()"
    )
    assert is_same


def test_a_group_can_be_hidden(opened: Browser) -> None:
    """Otherwise one area could not be looked at alone."""
    opened.run("tieline.drawAll().then(() => 1)")
    shown = "tieline.charts.shown.get('vt').chart.series.filter(s => s.show).length"
    before = opened.run(shown)
    opened.run(
        "[...document.querySelectorAll('#chart-vt button.chip')].find(c =>"
        " c.textContent.startsWith('North')).click()"
    )
    assert before - opened.run(shown) == 14


@pytest.mark.parametrize("size", [(1280, 800), (390, 844)])
def test_nothing_is_cut_off_sideways(browser: Browser, page: Path, size: tuple[int, int]) -> None:
    """Otherwise a page on a narrow screen would hide what stands on its right."""
    browser.open(page, size, "dark")
    browser.run("tieline.drawAll().then(() => 1)")
    assert browser.run("document.documentElement.scrollWidth") <= size[0]
    paper = browser.run("getComputedStyle(document.body).backgroundColor")
    assert paper == "rgb(18, 22, 28)"
    assert browser.errors == []
