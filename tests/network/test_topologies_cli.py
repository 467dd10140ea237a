"""`tieline topology` from the command line: what it writes, says, draws and refuses."""

from pathlib import Path

import matplotlib.pyplot as plt
import pytest
from typer.testing import CliRunner

from tieline.cli import app
from tieline.network.settings import NetworkSettings
from tieline.network.topologies.picture import kinds_of, link_widths, picture, positions
from tieline.network.topologies.summary import summary_of
from tieline.network.topology import read_topology

RUN = CliRunner()
ZOO = Path(__file__).parent / "data" / "zoo"

SMALL = """\
link_defaults: {rate: 10 Mbit/s, queue: 50}
pmu: {processing: 1 ms}
nodes:
  CC_X: {x: 0, y: 10}
  hub: {x: 0, y: 0}
  one: {buses: [1], x: -10, y: 0}
  two: {buses: [2], x: 10, y: 0}
  three: {buses: [3], x: 0, y: -10}
  bare: {buses: [4], x: 5, y: -10}
links:
  - {a: CC_X, b: hub, propagation: 1 ms, rate: 1 Gbit/s}
  - {a: hub, b: one, propagation: 2 ms}
  - {a: hub, b: two, propagation: 3 ms}
  - {a: one, b: two, propagation: 1 ms}
  - {a: two, b: three, propagation: 4 ms}
  - {a: two, b: bare, propagation: 4 ms, rate: 100 Mbit/s}
"""
PMUS = [{"name": "pmu00", "bus": 1}, {"name": "pmu01", "bus": 2}]
CONTROLLERS = [
    {"name": "ctl00", "unit": "G1", "bus": 2},
    {"name": "ctl01", "unit": "G2", "bus": 3},
]


def invoke(*words: str) -> str:
    result = RUN.invoke(app, ["topology", *words], env={"COLUMNS": "200"})
    assert result.exit_code == 0, result.output
    return result.output


@pytest.fixture
def small(tmp_path: Path) -> Path:
    path = tmp_path / "small.yaml"
    path.write_text(SMALL, encoding="utf-8")
    return path


def test_new_check_and_draw_go_together(tmp_path):
    """Otherwise what one command writes another would not read."""
    path = tmp_path / "net.yaml"
    text = invoke("new", "hierarchical", "--nodes", "40", "--regions", "3", "-o", str(path))
    assert "40 nodes" in text
    text = invoke("check", str(path))
    assert "links that part it alone         none" in text
    for suffix in ("png", "svg"):
        picture = tmp_path / f"net.{suffix}"
        invoke("draw", str(path), "-o", str(picture))
        assert picture.stat().st_size > 5_000


def test_a_shipped_topology_is_found_by_its_case_and_served_with_it():
    """Otherwise an installed tieline could not show its own networks."""
    text = invoke("check", "miniwecc")
    assert "58, with 122 buses" in text
    assert "mean 98.922" in text
    assert "5: S002 - S080, S004 - S079, S006 - S106, S031 - S084, S075 - S101" in text
    text = invoke("check", "miniwecc/wan")
    assert "mean 99.996" in text
    assert "links that must fail to part it  2\n" in text


def test_import_writes_a_file_that_serves_a_case(tmp_path):
    """Otherwise an imported network could not carry an experiment."""
    path = tmp_path / "cities.yaml"
    words = ("--case", "two_area", "--spread", "-o", str(path))
    invoke("import", str(ZOO / "parallel.gml"), *words)
    assert "serves the case two_area" in invoke("check", str(path), "--case", "two_area")


def test_the_summary_by_hand(small):
    """Otherwise the check would praise a network that hangs on one link.

    Without processing or serialisation (62 bytes: 49.6 us at 10 Mbit/s, 4.96 us at 100 Mbit/s,
    0.496 us at 1 Gbit/s): the farthest pair is CC_X and three, over hub and two.
    """
    spec = read_topology(small, [], [], NetworkSettings())
    summary = summary_of(spec)
    assert summary.bridges == (("CC_X", "hub"), ("bare", "two"), ("three", "two"))
    assert summary.articulation_points == ("hub", "two")
    assert summary.edge_connectivity == "1"
    assert summary.rates_bps == {10_000_000: 4, 100_000_000: 1, 1_000_000_000: 1}
    least, _, most = summary.delays_ns
    assert least == pytest.approx(1_000_496)
    assert most == pytest.approx(8_000_000 + 496 + 2 * 49_600)
    served = summary_of(read_topology(small, PMUS, CONTROLLERS, NetworkSettings()))
    assert served.delays_ns[0] == 1_000_000
    assert served.delays_of == "4 flows, processing included"


def test_what_stands_at_a_node_decides_how_it_is_drawn(small):
    """Otherwise a picture would show a PMU where there is none."""
    spec = read_topology(small, PMUS, CONTROLLERS, NetworkSettings())
    assert dict(zip([n.name for n in spec.nodes], kinds_of(spec), strict=True)) == {
        "CC_X": "control centre",
        "hub": "router without a bus",
        "one": "substation with a PMU",
        "two": "substation with PMU and controller",
        "three": "substation with a controller",
        "bare": "substation",
    }
    widths = link_widths(spec)
    # Equal steps for equal ratios: 10, 100, 1000 Mbit/s.
    slow, middle, fast = (widths[rate] for rate in sorted(widths))
    assert middle == pytest.approx((slow + fast) / 2)
    assert fast > 2 * slow
    figure = picture(spec, "small")
    legend = {text.get_text() for text in figure.legends[0].get_texts()}
    assert legend >= {*kinds_of(spec), "10 Mbit/s", "100 Mbit/s", "1 Gbit/s"}
    names = {text.get_text() for text in figure.axes[0].texts}
    assert names == {node.name for node in spec.nodes}
    assert not plt.get_fignums()


def test_nodes_without_coordinates_are_laid_out(small):
    """Otherwise a file without x and y could not be drawn."""
    small.write_text(SMALL.replace("x: 5, y: -10", ""), encoding="utf-8")
    spec = read_topology(small, [], [], NetworkSettings())
    xy, has_places = positions(spec)
    assert not has_places
    assert xy.shape == (6, 2)
    assert len({tuple(row) for row in xy.round(3)}) == 6


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("new", "rng", "miniwecc"), "no kind 'rng'; did you mean 'ring'?"),
        (("new", "ring"), "give either a case or --nodes"),
        (("new", "ring", "miniwecc", "--nodes", "5"), "give either a case or --nodes"),
        (("new", "ring", "miniwecc", "--seed", "5"), "--seed needs --nodes"),
        (("new", "ring", "miniwec"), "no case 'miniwec': give one of"),
        (("new", "ring", "--nodes", "5", "--degree", "3"), "--degree belongs to mesh: ring does"),
        (("new", "ring", "--nodes", "5", "--rate", "5 Mbps"), "--rate must be a rate in one of"),
        (("new", "ring", "--nodes", "5", "--rate", "0"), "--rate must be from 1 bit/s to 10,000"),
        (("new", "ring", "--nodes", "5", "--queue", "0"), "--queue must be from 1 to 100000"),
        (("new", "ring", "--nodes", "5", "--overhead", "-1"), "--overhead must be from 0 to 1000"),
        (
            ("new", "ring", "--nodes", "5", "--propagation", "1 ms", "--distance", "1 km"),
            "--propagation and --distance do not go together",
        ),
        (("new", "ring", "--nodes", "5", "--spacing", "1 m"), "--spacing must be 0.1 km or more"),
        (("new", "ring", "--nodes", "5", "--seed", "-1"), "--seed must be 0 or more"),
        (
            ("new", "hierarchical", "--nodes", "9", "--cross-traffic"),
            "--cross-traffic is that of control centres: give --control-centres, too",
        ),
        (("import", "nowhere.gml"), "nowhere.gml: cannot be read"),
        (("import", "a.gml", "--factor", "0.5"), "--factor must be from 1 to 10 (got 0.5)"),
        (("import", "a.gml", "--missing", "guess"), "--missing must be refuse, neighbours or drop"),
        (("import", "a.gml", "--spread"), "--buses and --spread assign the buses of a case"),
        (("import", "a.gml", "--case", "two_area"), "give either --buses CSV"),
    ],
)
def test_bad_input_is_refused_with_what_is_allowed(tmp_path, words, message):
    """Otherwise a slip would write another network, or end in a traceback."""
    path = tmp_path / "out.yaml"
    result = RUN.invoke(app, ["topology", *words, "-o", str(path)])
    assert result.exit_code == 2
    assert message in result.output
    assert not path.exists()


def test_a_file_is_not_overwritten_unasked(tmp_path):
    """Otherwise a file with figures chosen by hand would be lost."""
    path = tmp_path / "net.yaml"
    path.write_text("mine", encoding="utf-8")
    words = ["topology", "new", "ring", "--nodes", "5", "-o", str(path)]
    result = RUN.invoke(app, words)
    assert result.exit_code == 2
    assert "is there already; --force overwrites it" in result.output
    assert path.read_text(encoding="utf-8") == "mine"
    assert RUN.invoke(app, [*words, "--force"]).exit_code == 0


def test_pictures_and_files_that_cannot_be_are_refused(small, tmp_path):
    """Otherwise matplotlib's own traceback would be the answer."""
    result = RUN.invoke(app, ["topology", "draw", str(small), "-o", "x.jpeg2"])
    assert (result.exit_code, "must end in .png, .svg, .pdf" in result.output) == (2, True)
    result = RUN.invoke(app, ["topology", "draw", "nothing"])
    assert (result.exit_code, "no topology 'nothing'" in result.output) == (2, True)
    result = RUN.invoke(app, ["topology", "check", str(small), "--case", "two_area"])
    assert (result.exit_code, "no node holds bus" in result.output) == (2, True)
