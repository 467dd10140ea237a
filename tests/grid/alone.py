"""One model on its own, integrated under given signals."""

from collections.abc import Callable, Mapping

import numpy as np

from conformance.examples import evaluate, signals
from conformance.linear import column
from tieline.grid.models.base import Model


class Alone:
    """One unit of a model at the operating point of the conformance tests.

    Args:
        model: the model.
        changes: parameters other than the example's.
        named: signals other than the operating point's.
    """

    def __init__(
        self,
        model: type[Model],
        changes: Mapping[str, float] | None = None,
        named: Mapping[str, float] | None = None,
    ) -> None:
        values = {**model.example, **(changes or {})}
        assert model.check(values) == []
        assert all(item.allows(values[item.symbol]) for item in model.parameters)
        self.model = model
        self.p = column(model, values)
        self.named = signals(1)
        for name, value in (named or {}).items():
            self.named[name] = np.array([value])
        self.x = np.ascontiguousarray(model.initialise(self.named, self.p))

    def set(self, **named: float) -> None:
        """Change signals from now on."""
        for name, value in named.items():
            self.named[name] = np.array([value])

    def look(self, x: np.ndarray | None = None) -> tuple[dict[str, float], dict[str, float]]:
        """Return derivatives by state and signals by name."""
        dx, after = evaluate(self.model, self.x if x is None else x, self.named, self.p)
        rates = dict(zip(self.model.states, dx[:, 0].tolist(), strict=True))
        return rates, {name: float(value[0]) for name, value in after.items()}

    def run(
        self, seconds: float, step_s: float = 0.002, watch: Callable[[], None] | None = None
    ) -> dict[str, float]:
        """Integrate with Heun's method; return the signals at the end."""
        for _ in range(round(seconds / step_s)):
            k1 = evaluate(self.model, self.x, self.named, self.p)[0]
            k2 = evaluate(self.model, self.x + step_s * k1, self.named, self.p)[0]
            self.x = self.x + 0.5 * step_s * (k1 + k2)
            if watch is not None:
                watch()
        return self.look()[1]
