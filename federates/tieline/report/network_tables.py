"""Writes the tables of a page's network: what links dropped, and what controllers waited for."""

import math

import pandas as pd

from tieline.report.html import Html, details, element, table

MOST_LINKS = 20


def links_table(links: pd.DataFrame) -> Html:
    """Return the links that dropped most, or else had the longest queue or the highest load."""
    if links.empty:
        return element("p", "This engine simulates no links.", class_="note")
    reasons = ["dropped_queue", "dropped_loss", "dropped_down"]
    ranked = links.assign(dropped=links[reasons].sum(axis=1)).sort_values(
        ["dropped", "max_queue", "utilisation"], ascending=False
    )
    total = int(ranked["dropped"].sum())
    lost = ranked[ranked["dropped"] > 0]
    kept = ranked.head(MOST_LINKS if total else 10)
    rows = [
        (
            f"{row['from']} to {row['to']}",
            f"{row['rate_bps'] / 1e6:g}",
            f"{100 * row['utilisation']:.1f}",
            f"{row['max_queue']:,}",
            *(f"{row[reason]:,}" for reason in reasons),
        )
        for _, row in kept.iterrows()
    ]
    said = (
        f"{total:,} packets were dropped, on {len(lost)} of {len(links)} directions of links"
        f" (cross traffic counts too); {min(len(kept), len(lost))} are shown."
        if total
        else f"No packet was dropped on any of the {len(links)} directions of links."
    )
    heads = ("link", "rate, Mbit/s", "mean load, %", "longest queue", "dropped: queue full",
             "lost on link", "link down")  # fmt: skip
    return Html(element("p", said) + table(heads, rows, "Links with most drops, or longest queues"))


def controllers_table(flows: pd.DataFrame, ages: pd.DataFrame) -> Html:
    """Return delays, losses and ages of each controller, in the order of the mean delay."""
    if flows.empty or "unit" not in flows or not flows["delivered"].any():
        return Html()
    age = {} if ages.empty else dict(zip(ages["unit"], ages["age_max_s"], strict=True))
    rows = []
    for unit, own in flows.groupby("unit", sort=False):
        ended = own["sent"].sum() - own["in_flight"].sum()
        arrived = own["delivered"].sum()
        total = (own["delay_mean_s"].fillna(0) * own["delivered"]).sum()
        mean = total / arrived if arrived else math.inf
        figures = (mean, own["delay_p95_s"].max(), own["delay_max_s"].max(), age.get(unit))
        loss = 100 * (1 - own["delivered"].sum() / ended) if ended else 0.0
        cells = [
            "-" if v is None or pd.isna(v) or v == math.inf else f"{1e3 * v:.1f}" for v in figures
        ]
        rows.append((-mean, (str(unit), *cells, f"{loss:.2f}")))
    heads = ("controller of", "mean delay, ms", "p95 of its slowest PMU, ms", "longest delay, ms",
             "oldest data, ms", "lost, %")  # fmt: skip
    ordered = [row for _, row in sorted(rows)]
    shown_table = table(heads, ordered, "Delay of each controller, the slowest first")
    return details(f"Delays of all {len(rows)} controllers as a table", shown_table)
