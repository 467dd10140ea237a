"""What every registered device model must hold, whoever wrote it."""

import numpy as np
import pytest

from conformance.examples import ALL_MODELS, evaluate, parameters, signals
from tieline.grid.models.base import ROLES, SIGNALS, Machine, Model
from tieline.grid.models.registry import models
from tieline.grid.plugins import installed_keys, shipped_keys

every_model = pytest.mark.parametrize("model", ALL_MODELS, ids=lambda model: model.key)


@every_model
def test_a_model_declares_itself_whole(model: type[Model]) -> None:
    """The table check, the reference page and the error texts come from these lines alone."""
    assert model.key == model.key.lower()
    assert model.source
    assert model.__doc__
    assert "Not modelled" in model.__doc__ or model.role == "pss"
    assert all(parameter.text and parameter.unit for parameter in model.parameters)
    symbols = [parameter.symbol for parameter in model.parameters]
    assert len(set(symbols)) == len(symbols)
    equations = (*model.equations, *((model.norton,) if issubclass(model, Machine) else ()))
    used = {name for equation in equations for name in (*equation.inputs, *equation.outputs)}
    assert used <= set(SIGNALS)


@every_model
def test_the_example_set_is_allowed_and_complete(model: type[Model]) -> None:
    """An example that the model itself refuses would teach nobody."""
    example = model.example
    assert model.example_source
    assert set(example) == {parameter.symbol for parameter in model.parameters}
    assert all(parameter.allows(example[parameter.symbol]) for parameter in model.parameters)
    assert model.check(example) == []


@every_model
def test_each_bound_refuses_what_lies_beyond_it(model: type[Model]) -> None:
    """A zero time constant divides by zero deep inside an integration."""
    for parameter in model.parameters:
        for limit, allowed, step in (
            (parameter.above, False, -1.0),
            (parameter.at_least, True, -1.0),
            (parameter.below, False, 1.0),
            (parameter.at_most, True, 1.0),
        ):
            if limit is not None:
                assert parameter.allows(limit) is allowed
                assert not parameter.allows(limit + step)


@every_model
def test_a_model_at_its_initial_point_is_at_rest(model: type[Model]) -> None:
    """A start that drifts would be taken for the effect of a disturbance."""
    p = parameters(model, 3)
    named = signals(3)
    x = model.initialise(named, p)
    before = {name: value.copy() for name, value in named.items()}
    dx, after = evaluate(model, x, named, p)
    # Roundings of numbers of size 1, divided by time constants down to 0.02 s, times K_A = 200.
    assert np.abs(dx).max() < 1e-10
    for name in ("Efd", "Pm", "v_s", "omega"):
        np.testing.assert_allclose(after[name], before[name], rtol=0, atol=1e-12)


@every_model
def test_units_together_equal_units_one_at_a_time(model: type[Model]) -> None:
    """One code path for many units must not mix them."""
    p, named = parameters(model, 4), signals(4)
    x = model.initialise(named, p)
    x = x + 0.01 * np.random.default_rng(5).normal(size=x.shape)
    together, outputs = evaluate(model, x, named, p)
    for unit in range(4):
        alone = {name: value[unit : unit + 1] for name, value in named.items()}
        dx, y = evaluate(model, x[:, unit : unit + 1], alone, p[:, unit : unit + 1].copy())
        np.testing.assert_array_equal(dx[:, 0], together[:, unit])
        assert all(y[name][0] == outputs[name][unit] for name in SIGNALS)


def test_the_registry_finds_every_shipped_model() -> None:
    """A model that discovery misses cannot be used in any table.

    A model's key is its file's name, which is how a name is known without loading anything.
    """
    for role in ROLES:
        assert set(models(role)) == {*shipped_keys(role), *installed_keys(role)}
    assert len({(model.role, model.key) for model in ALL_MODELS}) == len(ALL_MODELS)
