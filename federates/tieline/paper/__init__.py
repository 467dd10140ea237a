"""What the paper shows, computed anew: each statement with a number of ours and a verdict."""

from tieline.paper.item import Found, Item, Spec
from tieline.paper.statement import Band, Row, Source, Statement, Verdict, judged

__all__ = ["Band", "Found", "Item", "Row", "Source", "Spec", "Statement", "Verdict", "judged"]
