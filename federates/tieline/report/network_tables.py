"""Writes the tables of a page's network: what links dropped, and what controllers waited for."""

import math

import numpy as np

from tieline.columns import Columns
from tieline.report.html import Html, details, element, table

MOST_LINKS = 20

_OF_FLOWS = ("sent", "in_flight", "delivered", "delay_mean_s", "delay_p95_s", "delay_max_s")


def links_table(links: Columns) -> Html:
    """Return the links that dropped most, or else had the longest queue or the highest load."""
    if not links or not len(links["from"]):
        return element("p", "This engine simulates no links.", class_="note")
    reasons = ["dropped_queue", "dropped_loss", "dropped_down"]
    dropped = np.sum([links[reason] for reason in reasons], axis=0)
    ranked = np.lexsort([-links["utilisation"], -links["max_queue"], -dropped])
    total, lost = int(dropped.sum()), int(np.count_nonzero(dropped))
    kept = ranked[: MOST_LINKS if total else 10]
    rows = [
        (
            f"{links['from'][i]} to {links['to'][i]}",
            f"{links['rate_bps'][i] / 1e6:g}",
            f"{100 * links['utilisation'][i]:.1f}",
            f"{links['max_queue'][i]:,}",
            *(f"{links[reason][i]:,}" for reason in reasons),
        )
        for i in kept
    ]
    said = (
        f"{total:,} packets were dropped, on {lost} of {len(ranked)} directions of links"
        f" (cross traffic counts too); {min(len(kept), lost)} are shown."
        if total
        else f"No packet was dropped on any of the {len(ranked)} directions of links."
    )
    heads = ("link", "rate, Mbit/s", "mean load, %", "longest queue", "dropped: queue full",
             "lost on link", "link down")  # fmt: skip
    return Html(element("p", said) + table(heads, rows, "Links with most drops, or longest queues"))


def controllers_table(flows: Columns, ages: Columns) -> Html:
    """Return delays, losses and ages of each controller, in the order of the mean delay."""
    if "unit" not in flows or not flows["delivered"].any():
        return Html()
    age = dict(zip(ages["unit"], ages["age_max_s"], strict=True)) if ages else {}
    rows = []
    for unit in dict.fromkeys(flows["unit"]):
        own = {name: flows[name][flows["unit"] == unit] for name in _OF_FLOWS}
        ended = own["sent"].sum() - own["in_flight"].sum()
        arrived = own["delivered"].sum()
        total = (np.nan_to_num(own["delay_mean_s"]) * own["delivered"]).sum()
        mean = total / arrived if arrived else math.inf
        longest = (np.fmax.reduce(own[name]) for name in ("delay_p95_s", "delay_max_s"))
        figures = (mean, *longest, age.get(unit, math.nan))
        loss = 100 * (1 - arrived / ended) if ended else 0.0
        cells = [f"{1e3 * v:.1f}" if math.isfinite(v) else "-" for v in figures]
        rows.append((-mean, (str(unit), *cells, f"{loss:.2f}")))
    heads = ("controller of", "mean delay, ms", "p95 of its slowest PMU, ms", "longest delay, ms",
             "oldest data, ms", "lost, %")  # fmt: skip
    ordered = [row for _, row in sorted(rows)]
    shown_table = table(heads, ordered, "Delay of each controller, the slowest first")
    return details(f"Delays of all {len(rows)} controllers as a table", shown_table)
