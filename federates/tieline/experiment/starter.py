"""Writes an experiment to start from: commented, sensible for its case, and ready to run."""

import os
import re
from pathlib import Path
from typing import TYPE_CHECKING

from tieline.errors import InputError
from tieline.experiment.case_list import networks_of
from tieline.experiment.json_schema import FILE_NAME, editor_line
from tieline.resources import case_folder, shipped

if TYPE_CHECKING:
    from tieline.grid.case import Case

LARGEST_SHARE = 0.06
"""A trip to start with takes no more of the generation: larger ones may take the system down."""

COMMENT_COLUMN = 30

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,79}")

_TEMPLATE = """\
# What happens to {case} after the loss of {unit}, with measurements that come late?
{editor}
# tieline validate {name}.yaml    checks it       tieline run {name}.yaml    runs it
# Every setting, with units and bounds: docs/experiment_reference.md, or tieline schema --markdown.
name: {name}
question: What happens to {case} after the loss of {unit}, with measurements that come late?
case: {case}                # tieline cases lists what there is
seed: 1                       # of all that is random; another seed, another run

grid:
  duration: {duration} s              # simulated time
  steps_per_second: {steps}     # of integration; a multiple of wams.reporting
  pss:
    model: generalized        # tieline models pss lists all; none switches them off
    gain: {gain}                   # K, pu on each machine's base
    beta1: 1                  # share of the unit's own speed against the average
    beta2: 0.5                # share of the average against synchronous speed
  events:                     # trips, faults, load steps and more, at an instant or on a condition
    - {{at: 1 s, trip_generator: {unit}}}

wams:
  reporting: {reporting}               # frames a second of each PMU
{network}
# Without the marks in front, this makes one run of each delay:
# sweep:
#   method: grid
#   over:
#     {swept}: {values}
"""

_PACKETS = """
network:
  engine: packet              # each frame a packet through links, queues and losses
  topology: {topology}              # tieline cases names the networks of each case
  loss: 0.1 %                 # of packets, on every link
  cross_traffic: 1            # factor on the other traffic in the network; 0 turns it off
# mean_delay: 250 ms          # lengthens the PMUs' processing until the mean delay is this
"""
_CONSTANT = """
network:
  engine: constant            # one delay for all; this case has no packet network of its own
  delay: 100 ms               # from measurement to use
"""


def write_starter(name: str, case: str, folder: Path) -> Path:
    """Return the file of a new experiment.

    Args:
        name: of the experiment, and of its file.
        case: a shipped case, or the path of a case's folder.
        folder: where the file goes.

    Raises:
        InputError: the name is none, there is such a file already, it cannot be written, or the
            case is unknown or faulty.
    """
    if not _NAME.fullmatch(name):
        raise InputError(
            f"a name has letters, digits, _ and -, begins with a letter or digit, and has 80 at"
            f" most (got {name!r}); the file is NAME.yaml"
        )
    path = folder / f"{name}.yaml"
    if path.exists():
        raise InputError(f"{path} is there already: give another name, or remove it")
    text = starter(name, case, folder)
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise InputError(f"{path} cannot be written ({error.strerror})") from error
    return path


def starter(name: str, case: str, folder: Path) -> str:
    """Return the text of a new experiment for a folder.

    Raises:
        InputError: the case is unknown or faulty.
    """
    # The case brings the compiled models with it, which other commands should not wait for.
    from tieline.grid.case import load_case

    found = load_case(case_folder(case))
    networks = networks_of(found.folder)
    network = _PACKETS.format(topology=networks[0]) if networks else _CONSTANT
    text = _TEMPLATE.format(
        name=name,
        case=_named(found.folder, case, folder),
        unit=unit_to_trip(found),
        duration=20,
        gain=9,
        reporting=found.base.frequency_Hz,
        steps=4 * 60 if found.base.frequency_Hz == 60 else 6 * 50,
        editor=editor_line(_schema_for(folder)),
        network=network,
        swept="network.mean_delay" if networks else "network.delay",
        values="[150 ms, 250 ms, 500 ms]" if networks else "[0 ms, 100 ms, 250 ms]",
    )
    return _aligned(text)


def unit_to_trip(case: "Case") -> str:
    """Return the unit with most power among those whose loss a system should stand.

    That is at most `LARGEST_SHARE` of the generation; if every unit has more, the one with least.
    """
    power = case.buses.p_gen[case.unit_bus]
    limit = LARGEST_SHARE * float(power.sum())
    by_power = sorted(range(len(case.units)), key=lambda i: (float(power[i]), case.units[i]))
    small = [i for i in by_power if 0 < power[i] <= limit]
    return case.units[small[-1] if small else by_power[0]]


def _aligned(text: str) -> str:
    """Return a text whose comments behind settings stand below each other."""
    lines = []
    for line in text.splitlines():
        setting, mark, comment = line.partition("  # ")
        is_behind = mark and not setting.startswith("# tieline")
        lines.append(f"{setting.rstrip():<{COMMENT_COLUMN}}# {comment}" if is_behind else line)
    return "\n".join(lines) + "\n"


def _named(found: Path, case: str, folder: Path) -> str:
    """Return how an experiment in a folder names a case."""
    if found.parent == shipped("cases").resolve():
        return found.name
    return os.path.relpath(found, folder.resolve())


def _schema_for(folder: Path) -> str:
    """Return the way to the schema: relative within one checkout, absolute from elsewhere."""
    schema = shipped("configs").resolve() / FILE_NAME
    home = schema.parent.parent
    if folder.resolve().is_relative_to(home):
        return os.path.relpath(schema, folder.resolve())
    return str(schema)
