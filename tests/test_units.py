"""Quantities with units."""

import pytest
from pydantic import BaseModel, Field, ValidationError

from tieline.units import (
    Bytes,
    PerSecond,
    QuantityError,
    Seconds,
    Share,
    converted,
    quantity,
    split,
    unit_of,
)


class Sample(BaseModel):
    """One field of each kind."""

    time: Seconds = 0.0
    loss: Share | None = Field(None, ge=0, lt=1)
    frames: PerSecond = Field(60, gt=0)
    size: Bytes = 1


@pytest.mark.parametrize(
    ("text", "dimension", "value"),
    [
        ("250 ms", "time", 0.25),
        ("2 min", "time", 120.0),
        ("2 Mbit/s", "rate", 2e6),
        ("1.4 GW", "power", 1400.0),
        ("2 %", "share", 0.02),
        ("0.02", "share", 0.02),
        ("1.5 kB", "size", 1500.0),
        (".5e1km", "length", 5000.0),
    ],
)
def test_a_quantity_counts_in_its_own_unit(text: str, dimension: str, value: float) -> None:
    """Otherwise 250 ms would be 250 s."""
    assert quantity(text, dimension) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize("wrong", ["5 km", "fast", "", "1 2 s", True, None, [1]])
def test_what_is_no_time_is_refused_with_the_units_that_are(wrong: object) -> None:
    """Otherwise a wrong unit would be read as a plain number."""
    with pytest.raises(QuantityError, match=r"must be a time (in one of s, ms|such as '10 s')"):
        quantity(wrong, "time")


def test_whole_numbers_take_text_and_stay_strict() -> None:
    """Otherwise 59.94 frames a second would become 59 without a word."""
    sample = Sample.model_validate({"frames": "0.03 kHz", "size": "1.5 kB", "loss": "2 %"})
    assert (sample.frames, sample.size, sample.loss) == (30, 1500, 0.02)
    for wrong in ("59.94 Hz", 59.94, True, "60 s", "-1 Hz"):
        with pytest.raises(ValidationError):
            Sample.model_validate({"frames": wrong})


def test_a_field_knows_its_unit() -> None:
    """Otherwise the reference and the error texts would need a second list of units."""
    units = {name: unit_of(field) for name, field in Sample.model_fields.items()}
    assert units == {"time": "s", "loss": "1", "frames": "Hz", "size": "B"}


def test_quantities_are_taken_apart_and_changed_into_another_unit() -> None:
    """Otherwise a range from 50 ms to 1 s could not be drawn from."""
    assert split("50 ms") == (50.0, "ms")
    assert split(3) == (3.0, "")
    assert split("3 parsec") is None
    assert converted(1.0, "s", "ms") == pytest.approx(1000.0)
