"""Verdicts follow from numbers by the declared rule, and every item declares what it needs."""

import math

import pytest

from paper.items import statement
from tieline.paper import Band, Statement, Verdict, judged
from tieline.paper.catalogue import ITEMS
from tieline.paper.sources import SOURCES
from tieline.paper.statement import about

STATEMENTS = [(item.id, each) for item in ITEMS for each in item.statements]
every_statement = pytest.mark.parametrize(
    ("item", "each"), STATEMENTS, ids=[each.id for _, each in STATEMENTS]
)


def verdict(value: float, **changes: object) -> Verdict:
    return judged("i", statement(**changes), {"it": value}).verdict


@pytest.mark.parametrize("value", [0.9, 1.0, 1.1])
def test_a_number_in_the_band_reproduces_the_statement(value: float) -> None:
    """Both ends belong to it, or a number that is stated as a bound would fail."""
    assert verdict(value) is Verdict.REPRODUCED


@pytest.mark.parametrize("value", [0.89, 1.11, -1.0, math.inf, -math.inf, math.nan])
def test_a_wrong_number_or_none_does_not(value: float) -> None:
    """A page on which nothing can fail would say nothing."""
    assert verdict(value) is Verdict.NOT


def test_a_number_that_was_not_found_is_not_reproduced_and_shown_as_none() -> None:
    """A missing number must not look like a good one."""
    row = judged("i", statement(), {})
    assert row.verdict is Verdict.NOT
    assert row.ours == "none"


def test_the_wider_band_counts_only_with_its_explanation_and_numbers() -> None:
    """The reader must see by how much and why, from numbers of this very run."""
    wide = statement(differs=Band(0.5, 1.5), difference="rotors give {other:.1f}, {lost:.1f}")
    row = judged("i", wide, {"it": 1.4, "other": 1.04})
    assert row.verdict is Verdict.DIFFERENT
    assert row.why == "not 0.9 to 1.1: rotors give 1.0, nan"
    assert judged("i", wide, {"it": 1.6}).verdict is Verdict.NOT


def test_what_is_held_against_a_number_keeps_it_from_being_plainly_reproduced() -> None:
    """A number met by construction proves nothing."""
    row = judged("i", statement(against="by construction"), {"it": 1.0})
    assert row.verdict is Verdict.DIFFERENT
    assert row.why == "by construction"
    assert verdict(2.0, against="by construction") is Verdict.NOT


def test_bands_say_where_a_number_may_lie() -> None:
    """They stand in the page as they are."""
    assert str(about(-14, 1)) == "-15 to -13"
    assert str(Band(high=2)) == "at most 2"
    assert str(Band(low=2)) == "at least 2"


@every_statement
def test_every_statement_has_a_source_a_reason_and_a_band_that_can_be_missed(
    item: str, each: Statement
) -> None:
    """A band without a reason is a number that was fitted to the result."""
    assert each.source in SOURCES
    assert each.text
    assert each.paper
    assert each.tolerance
    assert math.isfinite(each.band.low) or math.isfinite(each.band.high)
    wrong = each.band.high + 1e3 if math.isfinite(each.band.high) else each.band.low - 1e3
    assert judged(item, each, {each.number: wrong}).verdict is Verdict.NOT
    if each.differs is not None:
        assert each.difference
        assert each.differs != each.band


def test_names_are_unique() -> None:
    """A verdict is referred to by its id, a figure by its item."""
    ids = [each.id for _, each in STATEMENTS]
    assert len(set(ids)) == len(ids)
    assert len({item.id for item in ITEMS}) == len(ITEMS)
