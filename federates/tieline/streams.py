"""One random generator for each random thing, derived from the experiment's seed and its name."""

import hashlib

import numpy as np


def stream(seed: int, name: str) -> np.random.Generator:
    """Return the generator of one random thing, such as `loss of S002->S080`.

    The same seed and name give the same numbers for ever; another name or seed gives numbers that
    are independent of them. The name enters through SHA-256, so that names that look alike are as
    far apart as any others, and through `SeedSequence`'s spawn key, which is made for this.

    Args:
        seed: the experiment's seed, 0 or more.
        name: what is random, in words; no two things of an experiment share a name.
    """
    words = np.frombuffer(hashlib.sha256(name.encode()).digest(), dtype="<u4")
    key = tuple(int(word) for word in words)
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed, spawn_key=key)))
