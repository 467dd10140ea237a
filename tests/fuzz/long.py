"""A longer search with atheris (libFuzzer): `python tests/fuzz/long.py TARGET [libFuzzer options]`.

It needs the extra `fuzz`. Without options it goes on for five minutes. Inputs that open new ways
through the code are kept in `tests/fuzz/corpus/TARGET` and are where the next search begins; one
that breaks something is written to `crash-...` in the working folder, and run again by giving its
path in the place of the options.
"""

import os
import sys
import warnings
from pathlib import Path

# Compiled functions cannot be followed, and the bytecode that atheris rewrites not compiled.
os.environ["TIELINE_COMPILER"] = "off"

import atheris

TARGETS = ("experiments", "cases", "topologies", "frames", "payloads", "results")
DEFAULTS = (
    "-max_total_time=300",
    "-len_control=0",
    "-max_len=2048",
    "-timeout=30",
    "-rss_limit_mb=3000",
)


def main() -> None:
    """Search with the target that the first argument names."""
    if len(sys.argv) < 2 or sys.argv[1] not in TARGETS:
        sys.exit(f"usage: {sys.argv[0]} {'|'.join(TARGETS)} [libFuzzer options]")
    name, options = sys.argv[1], sys.argv[2:] or list(DEFAULTS)
    tests = Path(__file__).parents[1]
    sys.path[:0] = [str(tests), str(tests.parent / "federates")]
    warnings.simplefilter("error")
    with atheris.instrument_imports(include=["tieline"]):
        import importlib

        target = importlib.import_module(f"fuzz.{name}")
    corpus = tests / "fuzz" / "corpus" / name
    corpus.mkdir(parents=True, exist_ok=True)
    atheris.Setup([sys.argv[0], str(corpus), *options], target.one_input)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
