"""Who comes in: what the broker asks of a federate on another host, and the federate of it."""

import secrets
from collections.abc import Callable, Mapping

from tieline.cosim.interfaces import FEDERATES
from tieline.errors import CosimError, InputError
from tieline.experiment.desk import Wire, hello, refusal
from tieline.experiment.keys import is_proof, proof
from tieline.experiment.plan import PlannedRun

_HELLO_S = 2.0
"""Who connects says hello at once; meanwhile those who have joined hear nothing."""
_ANSWER_S = 5.0
_NONCE_BYTES = 16
_WRONG_KEY = "it has another key than the broker"


class RefusedError(InputError):
    """The broker runs another experiment or another release, or the keys differ."""


class Door:
    """The broker's side.

    Args:
        planned: the run.
        key: what federates must have, or None.
        say: is told who comes, and who is sent away.

    Attributes:
        helics_key: HELICS's key of this run, made of the key and what only this run has; None
            without a key.
    """

    def __init__(self, planned: PlannedRun, key: str | None, say: Callable[[str], None]) -> None:
        self._planned, self._key, self._say = planned, key, say
        self._run = secrets.token_hex(_NONCE_BYTES)
        self.helics_key = None if key is None else proof(key, "helics", self._run)

    def examined(self, wire: Wire, wires: Mapping[str, Wire]) -> str | None:
        """Return the name of a federate that may join; answer it either way.

        Args:
            wire: its connection, which is closed if it may not.
            wires: those who have joined, by name.
        """
        try:
            theirs = wire.wait(_HELLO_S)
            name = str(theirs.get("federate"))
            reason = self._key_refusal(wire, theirs.get("nonce"), name)
        except CosimError as error:
            self._say(f"somebody at {wire.other_address} said nothing: {error}")
            wire.close()
            return None
        if reason is None:
            reason = refusal(hello(self._planned, name), theirs)
            if name not in FEDERATES:
                reason = f"there is no federate {name!r}"
            elif name in wires:
                reason = f"the {name} has joined already, from {wires[name].other_address}"
        if reason is not None:
            self._say(f"refused {wire.other_address}: {reason}")
            wire.send({"refused": reason})
            wire.close()
            return None
        self._say(f"{name} comes from {wire.other_address}")
        wire.send({"accepted": name})
        return name

    def _key_refusal(self, wire: Wire, nonce: object, name: str) -> str | None:
        """Return why a federate has not shown that it has the key; None if it has."""
        if self._key is None:
            return None if nonce is None else "it has a key, and the broker has none"
        if not isinstance(nonce, str):
            return "it has no key, and the broker asks for one"
        challenge = secrets.token_hex(_NONCE_BYTES)
        own = proof(self._key, "broker", nonce, challenge, self._run)
        wire.send({"challenge": challenge, "run": self._run, "proof": own})
        answer = wire.wait(_HELLO_S)
        known = is_proof(answer.get("proof"), self._key, "federate", name, nonce, challenge)
        return None if known else _WRONG_KEY


def introduce(wire: Wire, planned: PlannedRun, federate: str, key: str | None) -> str | None:
    """Return HELICS's key once the broker has accepted a federate; None without a key.

    Raises:
        RefusedError: the broker does not accept it, or does not have the key itself.
        CosimError: the broker does not answer.
    """
    own = hello(planned, federate)
    nonce = secrets.token_hex(_NONCE_BYTES)
    wire.send(own if key is None else own | {"nonce": nonce})
    answer = wire.wait(_ANSWER_S)
    helics_key = None
    if key is not None and "refused" not in answer:
        challenge, run = str(answer.get("challenge")), str(answer.get("run"))
        if not is_proof(answer.get("proof"), key, "broker", nonce, challenge, run):
            wire.send({"proof": ""})
            raise RefusedError(f"the broker at {wire.other_address} has not the key given here")
        wire.send({"proof": proof(key, "federate", federate, nonce, challenge)})
        helics_key = proof(key, "helics", run)
        answer = wire.wait(_ANSWER_S)
    if "refused" in answer:
        raise RefusedError(f"the broker at {wire.other_address} refused: {answer['refused']}")
    return helics_key
