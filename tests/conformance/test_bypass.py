"""A time constant that may be zero bypasses its block, and one that is not does not."""

from collections.abc import Mapping

import numpy as np
import pytest

from conformance.examples import ALL_MODELS, evaluate, signals
from conformance.linear import column, transfer
from tieline.grid.models.base import Model

CONTROLS = [model for model in ALL_MODELS if model.role != "machine"]


def may_be_zero(model: type[Model]) -> list[str]:
    return [p.symbol for p in model.parameters if p.unit in ("s", "s2") and p.at_least == 0]


def with_zero(model: type[Model], symbol: str) -> Mapping[str, float]:
    """Return the example with one time constant 0, and another too where that needs it."""
    for partner in (symbol, *may_be_zero(model)):
        values = {**model.example, symbol: 0.0, partner: 0.0}
        if not model.check(values):
            return values
    raise AssertionError(f"{model.key} never allows {symbol} = 0, though its bound does")


def assert_rest_and_transfer(model: type[Model], values: Mapping[str, float]) -> None:
    p, named = column(model, values), signals(1)
    x = model.initialise(named, p)
    dx, _ = evaluate(model, x, named, p)
    assert np.isfinite(x).all()
    # Roundings of numbers of size 1, times K_A / T_A of 1e4.
    assert np.abs(dx).max() < 1e-10
    s = 2j * np.pi * 0.7
    at = {name: float(value[0]) for name, value in named.items()}
    for (given, got), declared in model.transfer(s, values, at).items():
        found = transfer(model, values, given, got, s)
        # As in test_linearisation.
        assert found == pytest.approx(declared, rel=1e-5), (given, got)


@pytest.mark.parametrize(
    ("model", "symbol"),
    [(model, symbol) for model in CONTROLS for symbol in may_be_zero(model)],
    ids=lambda item: item if isinstance(item, str) else item.key,
)
def test_a_zero_time_constant_takes_its_block_out(model: type[Model], symbol: str) -> None:
    """Published data are full of zeros; a division would end the run, a stand-in alter it."""
    assert_rest_and_transfer(model, with_zero(model, symbol))


@pytest.mark.parametrize("model", CONTROLS, ids=lambda model: model.key)
def test_blocks_that_the_example_bypasses_work_too(model: type[Model]) -> None:
    """An example with T_R = 0 says nothing about the transducer of a unit that has one."""
    zero = {symbol: 0.03 for symbol in may_be_zero(model) if model.example[symbol] == 0}
    values = {**model.example, **zero}
    assert model.check(values) == []
    assert_rest_and_transfer(model, values)
