"""Each control model's linearisation against the transfer function of its diagram."""

import numpy as np
import pytest

from conformance.examples import ALL_MODELS, signals
from conformance.linear import transfer
from tieline.grid.models.base import Model


@pytest.mark.parametrize("frequency_hz", [0.02, 0.4, 1.5])
@pytest.mark.parametrize("model", ALL_MODELS, ids=lambda model: model.key)
def test_the_linearisation_is_the_declared_transfer_function(
    model: type[Model], frequency_hz: float
) -> None:
    """A wrong sign or a swapped time constant would turn damping into excitation."""
    s = 2j * np.pi * frequency_hz
    at = {name: float(value[0]) for name, value in signals(1).items()}
    for (given, got), declared in model.transfer(s, model.example, at).items():
        # The equations are linear inside their limits; differences of 1e-6 leave 1e-9 of rounding,
        # times gains up to K_A / T_A = 1e4.
        found = transfer(model, model.example, given, got, s)
        assert found == pytest.approx(declared, rel=1e-5), (given, got)


@pytest.mark.parametrize("model", ALL_MODELS, ids=lambda model: model.key)
def test_every_control_declares_a_transfer_function(model: type[Model]) -> None:
    """A control that declared none would never be held against its diagram."""
    at = {name: float(value[0]) for name, value in signals(1).items()}
    assert bool(model.transfer(1j, model.example, at)) is (model.role != "machine")
