"""Writes what a page says in words and tables: question, settings, answer, provenance."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from tieline.experiment.results import Run
from tieline.experiment.table import FIELDS, Summary, shown
from tieline.report.html import Html, details, element, pairs, table

NAMES = {
    "delay_mean_s": "Mean combined delay",
    "delay_p95_s": "95 % of packets within",
    "jitter_s": "Jitter (RFC 3393)",
    "loss": "Packets lost",
    "nadir_hz": "Lowest system frequency",
    "nadir_s": "reached at",
    "settling_hz": "Settles at",
    "swing_hz": "Frequency of the tie-line swing",
    "damping_ratio": "Its damping ratio",
    "wall_s": "Wall time of the run",
}
"""The fields of the closing table, in words."""


def head(manifest: Mapping[str, Any], label: str | None, seed: str) -> Html:
    """Return the top of a page: name, question, and what identifies the result."""
    status = str(manifest["status"])
    items: list[tuple[object, object]] = [
        ("result", element("span", status, class_=f"status {status}")),
        ("tieline", manifest["versions"]["tieline"]),
        ("config hash", element("code", manifest["config_hash"][:16])),
    ]
    items += [("seed", seed)] if seed else []
    items += [("run", element("code", manifest["run_id"]))] if "run_id" in manifest else []
    name = manifest["name"] if not label else f"{manifest['name']}: {label}"
    reason = manifest.get("reason")
    return Html(
        element("h1", name)
        + element("p", manifest["question"], class_="question")
        + pairs(items)
        + (element("p", f"Incomplete: {reason}", class_="warning") if reason else "")
    )


def asked(run: Run) -> Html:
    """Return what was asked: the main settings, and behind a line all of them."""
    config = run.config
    grid, network, wams = config["grid"], config["network"], config["wams"]
    reporting = wams["reporting"]
    items = [
        ("case", config["case"]),
        ("simulated", f"{grid['duration']:g} s ({grid['method']}, {grid['steps_per_second']}/s)"),
        ("disturbance", "; ".join(_event(event) for event in grid["events"]) or "none"),
        ("stabilisers", _stabilisers(grid["pss"])),
        ("PMU reports", reporting if reporting == "continuous" else f"{reporting} frames/s"),
        ("network", _network(network)),
    ]
    events = [_event(event) for event in network.get("events", [])]
    traffic = [_event(flow) for flow in network.get("traffic", [])]
    items += [("network events", "; ".join(events))] if events else []
    items += [("added traffic", "; ".join(traffic))] if traffic else []
    rows = [(key, value) for key, value in _flat(config) if key not in ("name", "question")]
    return Html(
        pairs(items)
        + details(
            f"All {len(rows)} settings in force",
            table(("setting", "value"), rows, "Every setting in force", numbers_from=9),
        )
    )


def points(runs: Sequence[Run]) -> Html:
    """Return what the points of a sweep differ in: a row each."""
    settings = [dict(_flat(run.config)) for run in runs]
    keys = list(dict.fromkeys(key for setting in settings for key in setting))
    missing = "-"
    differ = [key for key in keys if len({s.get(key, missing) for s in settings}) > 1]
    rows = [
        (run.label, *(setting.get(key, missing) for key in differ))
        for run, setting in zip(runs, settings, strict=True)
    ]
    said = element("p", f"{len(runs)} points, which differ in {len(differ)} settings:")
    return Html(said + table(("point", *differ), rows, "Settings that differ", numbers_from=99))


def answer(run: Run, events: Iterable[tuple[float, str]]) -> Html:
    """Return the answer of one run: its numbers, what happened, and what could not be told."""
    summary = run.summary()
    rows: dict[str, list[tuple[str, str, str]]] = {f.path[0]: [] for f in FIELDS}
    for f in FIELDS:
        rows[f.path[0]].append((NAMES.get(f.name, f.name), *_with_unit(summary, f)))
    of_the_grid = rows["frequency"] + rows["swing"]
    lowest = summary.get("lowest_voltage")
    if lowest:
        said = f"pu, unit {lowest['unit']} at {lowest['t_s']:.1f} s"
        of_the_grid.append(("Lowest terminal voltage", f"{lowest['vt_pu']:.3f}", said))
    of_the_network = rows["delay"]
    age = summary.get("age", {}).get("mean_s")
    if age is not None:
        of_the_network.append(("Mean age of the data acted on", f"{1e3 * age:.1f}", "ms"))
    of_the_network += rows["packets"] + _packets(summary.get("packets", {}))
    remarks = [summary.get("ending"), _no_swing(summary)]
    happened = [(f"{at_s:.3f}", what) for at_s, what in events]
    tables = (
        _table_of_three("Grid", of_the_grid),
        _table_of_three("Network", of_the_network),
        table(("time, s", "what happened"), happened, "Events", 9) if happened else "",
    )
    return Html(
        element("div", *tables, class_="answers")
        + "".join(element("p", remark, class_="warning") for remark in remarks if remark)
    )


def comparison(runs: Sequence[Run], pages: Sequence[str | None]) -> Html:
    """Return the table of a sweep's points, each with a link to its own page, if it has one."""
    heads = ["run", *(_heading(field) for field in FIELDS)]
    rows = []
    for run, page in zip(runs, pages, strict=True):
        name = element("a", run.label, href=page) if page else run.label
        if not run.is_complete:
            rows.append([Html(f"{name} (incomplete)"), *("-" for _ in FIELDS)])
            continue
        summary = run.summary()
        rows.append([name, *(shown(summary, field) for field in FIELDS)])
    remarks = [
        element("p", f"{run.label}: {remark}", class_="warning")
        for run in runs
        if run.is_complete
        for remark in (run.summary().get("ending"), _no_swing(run.summary()))
        if remark
    ]
    return Html(table(heads, rows, "All points of the sweep") + "".join(remarks))


def provenance(manifest: Mapping[str, Any], files: Iterable[str]) -> Html:
    """Return what the result was made with, and what lies beside the page."""
    versions = ", ".join(f"{name} {v}" for name, v in manifest["versions"].items())
    items: list[tuple[object, object]] = [
        ("config hash (SHA-256)", element("code", manifest["config_hash"])),
        ("versions", versions),
    ]
    if "random_streams" in manifest:
        items.append(("randomness", _randomness(manifest)))
    for name, digest in manifest.get("inputs", {}).items():
        items.append((f"hash of the {name}", element("code", digest)))
    listed = element("p", *_listed(files))
    return Html(pairs(items) + listed)


def _randomness(manifest: Mapping[str, Any]) -> str:
    streams = manifest["random_streams"]
    if isinstance(streams, str):
        return f"seed {manifest['seed']}; {streams}"
    families = streams.get("network", [])
    count = sum(len(family["taken"]) for family in families)
    listed = f"; {count} streams of the network, named in manifest.json" if count else ""
    seed = f"seed {streams['seed']}; " if "seed" in streams else ""
    return f"{seed}{streams['generator']}{listed}"


def figures(folder: Path) -> Html:
    """Return links to the figures of a result, if any are drawn."""
    names = sorted(f"plots/{path.name}" for path in folder.glob("plots/*.svg"))
    items = (element("li", element("a", name, href=name)) for name in names)
    words = "Figures for papers: SVG, and PNG beside them"
    return details(words, element("ul", *items)) if names else Html()


def _listed(files: Iterable[str]) -> Iterator[Html]:
    for i, name in enumerate(files):
        yield Html((", " if i else "Beside this page: ") + element("a", name, href=name))


def _with_unit(summary: Summary, field: Any) -> tuple[str, str]:
    _, _, unit = field.heading.partition("\n")
    return shown(summary, field), "" if unit == "ratio" else unit


def _heading(field: Any) -> str:
    return str(field.heading).replace("\n", ", ").replace("damp.,", "damping")


def _table_of_three(caption: str, rows: Sequence[tuple[str, str, str]]) -> Html:
    body = [
        element(
            "tr",
            element("th", name, scope="row"),
            element("td", value, class_="n"),
            element("td", unit),
        )
        for name, value, unit in rows
    ]
    return element("table", element("caption", caption), element("tbody", *body))


def _packets(packets: Mapping[str, int]) -> list[tuple[str, str, str]]:
    if not packets.get("sent"):
        return []
    rows = [("PMU packets sent", f"{packets['sent']:,}", "")]
    for name, words in (
        ("delivered", "delivered"),
        ("dropped_queue", "found a queue full"),
        ("dropped_loss", "lost on a link"),
        ("dropped_down", "lost with a link that was down"),
        ("in_flight", "under way at the end"),
    ):
        if packets.get(name):
            rows.append((f"... {words}", f"{packets[name]:,}", ""))
    return rows


def _no_swing(summary: Summary) -> str | None:
    reason = summary.get("swing", {}).get("reason")
    return f"No swing read off: {reason}" if reason else None


def _stabilisers(pss: Mapping[str, Any]) -> str:
    names = ("gain", "beta1", "beta2", "average", "units")
    given = [f"{n} {_shown(pss[n])}" for n in names if pss.get(n) is not None]
    return f"{pss['model']}: {', '.join(given)}"


def _network(network: Mapping[str, Any]) -> str:
    words = [f"engine {network['engine']}"]
    if network["engine"] in ("packet", "ns3"):
        words.append(f"topology {network['topology']}")
    for key, unit in (("delay", " s"), ("mean_delay", " s"), ("loss", ""), ("cross_traffic", "")):
        value = network.get(key)
        if value is not None and not (key == "cross_traffic" and value == 1):
            words.append(f"{key} {value:g}{unit}")
    return ", ".join(words)


def _event(event: Mapping[str, Any]) -> str:
    """Return an event as its settings have it, without those that are not given."""
    given = {key: value for key, value in event.items() if value is not None}
    when = f"at {_shown(given.pop('at'))} s: " if "at" in given else ""
    return when + ", ".join(f"{key} {_shown(value)}" for key, value in given.items())


def _flat(config: Mapping[str, Any], path: str = "") -> Iterator[tuple[str, str]]:
    for key, value in config.items():
        if isinstance(value, dict) and value:
            yield from _flat(value, f"{path}{key}.")
        else:
            yield f"{path}{key}", _shown(value)


def _shown(value: Any) -> str:
    if isinstance(value, list):
        return ", ".join(_shown(part) for part in value) or "none"
    if isinstance(value, dict):
        return f"({_event(value)})" if value else "none"
    return "none" if value is None else f"{value:g}" if isinstance(value, float) else str(value)
