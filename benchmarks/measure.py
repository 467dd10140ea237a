"""Runs every benchmark, one after the other, and writes docs/performance.md from what they say.

    .venv/bin/python benchmarks/measure.py                      all of them, without peers
    .venv/bin/python benchmarks/measure.py --peers build/peers  with what `make peers` installs
    .venv/bin/python benchmarks/measure.py --only grid_alone    this one anew, the others as stored
    .venv/bin/python benchmarks/measure.py --page               the page alone, from what is stored

The figures of the last run of each benchmark stand in benchmarks/figures/ as JSON.
"""

import argparse
import json
import os
import platform
import subprocess
import sys
import time
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

from figures import Row, table

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
STORED = HERE / "figures"
PAGE = ROOT / "docs" / "performance.md"
TEXT = HERE / "performance.md"
MARK = "<!-- figures -->"

PACKAGES = ("helics", "numba", "numpy", "scipy", "pyarrow")


@dataclass(frozen=True)
class Benchmark:
    """One script, what it is about, and the peers that it measures beside tieline."""

    name: str
    title: str
    peers: tuple[str, ...] = ()

    def command(self, peers: Path | None) -> list[str]:
        """Return its command line; `peers` holds an environment for each peer."""
        words = [f"benchmarks/{self.name}.py"]
        for peer in self.peers:
            if peers is not None:
                words += [f"--{peer}", f"{peers / peer / 'bin' / 'python'}"]
        return words


BENCHMARKS = (
    Benchmark("grid_alone", "The grid alone", ("andes", "dpsim")),
    Benchmark("grid_growth", "Larger grids"),
    Benchmark("packet_engine", "The packet engine", ("ns3",)),
    Benchmark("network_growth", "Larger networks"),
    Benchmark("federation", "A whole federation"),
    Benchmark("startup", "Starting"),
    Benchmark("sweep", "Sweeps"),
    Benchmark("linear", "Linear analysis", ("andes",)),
)


def machine() -> dict[str, str]:
    """Return what the figures were measured on."""
    model = platform.processor() or platform.machine()
    for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
        if line.startswith("model name"):
            model = line.split(":", 1)[1].strip()
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    packages = ", ".join(f"{name} {metadata.version(name)}" for name in PACKAGES)
    return {
        "processor": f"{model}, {len(os.sched_getaffinity(0))} cores, {memory / 1e9:.0f} GB",
        "system": f"{platform.system()} {platform.release()}, Python {platform.python_version()}",
        "packages": packages,
    }


def measure(benchmark: Benchmark, peers: Path | None) -> None:
    """Run one benchmark and store its figures, its command, its day and the machine's load."""
    command = benchmark.command(peers)
    part = STORED / f"{benchmark.name}.part"
    load_before = os.getloadavg()[0]
    began = time.monotonic()
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "federates")}
    subprocess.run(
        [sys.executable, *command, "--json", str(part)], cwd=ROOT, env=environment, check=True
    )
    facts = {
        "command": " ".join(
            [".venv/bin/python", *benchmark.command(peers and Path("build/peers"))]
        ),
        "day": time.strftime("%Y-%m-%d"),
        "wall_s": round(time.monotonic() - began),
        "load_before": round(load_before, 1),
        "machine": machine(),
        "rows": json.loads(part.read_text()),
    }
    (STORED / f"{benchmark.name}.json").write_text(json.dumps(facts, indent=1) + "\n")
    part.unlink()


def section(benchmark: Benchmark) -> list[str]:
    """Return what the page says of one benchmark's last figures."""
    path = STORED / f"{benchmark.name}.json"
    if not path.exists():
        return [f"## {benchmark.title}", "", "Not measured yet.", ""]
    facts = json.loads(path.read_text())
    rows = [Row(**row) for row in facts["rows"]]
    lines = [f"## {benchmark.title}", "", f"    {facts['command']}", "", *table(rows), ""]
    lines += [
        f"Measured on {facts['day']} in {facts['wall_s']} s, with a load of"
        f" {facts['load_before']} at its beginning, on {facts['machine']['processor']};"
        f" {facts['machine']['system']}; {facts['machine']['packages']}.",
        "",
    ]
    return lines


def write_page() -> None:
    """Write the page: the text that people wrote, and the figures in their place."""
    before, after = TEXT.read_text(encoding="utf-8").split(MARK)
    sections = [line for benchmark in BENCHMARKS for line in section(benchmark)]
    PAGE.write_text(before + "\n".join(sections).strip() + "\n" + after, encoding="utf-8")


def main() -> None:
    """Measure what was asked for and write the page."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    names = [benchmark.name for benchmark in BENCHMARKS]
    parser.add_argument("--only", action="append", choices=names, help="measure these alone")
    parser.add_argument("--page", action="store_true", help="measure nothing, write the page")
    parser.add_argument("--peers", type=Path, help="folder with an environment for each peer")
    options = parser.parse_args()
    STORED.mkdir(exist_ok=True)
    for benchmark in BENCHMARKS if not options.page else ():
        if options.only is None or benchmark.name in options.only:
            print(f"== {benchmark.title}", flush=True)
            measure(benchmark, options.peers)
    write_page()
    print(f"{PAGE.relative_to(ROOT)} is written")


if __name__ == "__main__":
    main()
