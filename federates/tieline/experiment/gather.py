"""Makes one result of the folders that federates without a launcher have left."""

import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from tieline.cosim.interfaces import FEDERATES
from tieline.cosim.word import read_word
from tieline.errors import CosimError, InputError
from tieline.experiment.export import check_empty
from tieline.experiment.launch import Outcome
from tieline.experiment.manifest import run_facts, save_manifest, write_json
from tieline.experiment.results import SUMMARY, Run, read_manifest
from tieline.experiment.summary import summarise
from tieline.experiment.supervise import ProcessUse
from tieline.logs import merge
from tieline.tables import salvage

Word = Mapping[str, Any]


class GatheredIncompleteError(CosimError):
    """A result was gathered of a run that did not reach its end."""


def gather(folders: Sequence[Path], target: Path) -> Path:
    """Return the result folder made of the folders of one run's federates.

    It is complete if the grid and the network both say that they reached the end.

    Args:
        folders: what `tieline join` or `helics run` has filled; they stay as they are.
        target: the result folder to make.

    Raises:
        InputError: a folder is of another run or version, two hold the same table, or the target
            is not free.
        GatheredIncompleteError: a federate failed or left no word; the result is marked so.
    """
    manifest = _one_run(folders)
    words = {name: _word(folders, name) for name in FEDERATES}
    _check_versions(words)
    check_empty(target)
    target.mkdir(parents=True, exist_ok=True)
    for folder in folders:
        _copy(folder, target)
    salvage(target)
    merge(target)
    reason = _reason(words)
    facts = run_facts(_outcome(words), target, manifest["seed"])
    result = {**manifest, **facts, "status": "incomplete", "reason": reason}
    if reason is None:
        result["status"] = "complete"
        write_json(target / SUMMARY, summarise(Run(target, result)))
    save_manifest(target, result)
    if reason is not None:
        raise GatheredIncompleteError(f"{reason}\nwhat was written is in {target}, marked so")
    return target


def _one_run(folders: Sequence[Path]) -> dict[str, Any]:
    manifests = [dict(read_manifest(folder)) for folder in folders]
    for key in ("config_hash", "inputs"):
        values = [manifest[key] for manifest in manifests]
        for folder, value in zip(folders, values, strict=True):
            if value != values[0]:
                raise InputError(
                    f"{folder} and {folders[0]} are not of one run: their {key} differ"
                    f" ({_difference(value, values[0])})"
                )
    return manifests[0]


def _difference(one: Any, other: Any) -> str:
    if not isinstance(one, dict):
        return f"{str(one)[:12]} and {str(other)[:12]}"
    keys = [key for key in one if one[key] != other.get(key)]
    return ", ".join(f"{key} {str(one[key])[:12]} and {str(other.get(key))[:12]}" for key in keys)


def _word(folders: Sequence[Path], name: str) -> Word | None:
    found = [(folder, read_word(folder, name)) for folder in folders]
    said = [(folder, word) for folder, word in found if word is not None]
    if len(said) > 1:
        places = " and ".join(str(folder) for folder, _ in said)
        raise InputError(f"the {name} has run twice: in {places}")
    return said[0][1] if said else None


def _check_versions(words: Mapping[str, Word | None]) -> None:
    known = [word for word in words.values() if word is not None]
    for key in ("tieline", "helics"):
        found = sorted({str(word[key]) for word in known})
        if len(found) > 1:
            raise InputError(f"the federates ran with {key} {' and '.join(found)}")


def _copy(folder: Path, target: Path) -> None:
    for path in sorted(folder.rglob("*")):
        place = target / path.relative_to(folder)
        if path.is_dir():
            place.mkdir(exist_ok=True)
        elif not place.exists():
            shutil.copy2(path, place)
        elif path.suffix in (".parquet", ".arrows", ".pcap", ".pcapng"):
            raise InputError(f"{path.relative_to(folder)} is in more than one of the folders")


def _reason(words: Mapping[str, Word | None]) -> str | None:
    """Return why a run is not whole: the failure of its own before that of another's making."""
    silent = [name for name, word in words.items() if word is None]
    failed = [(name, word) for name, word in words.items() if word and word["exit_code"]]
    failed.sort(key=lambda item: item[1].get("fault") != "own")
    if failed and (not silent or failed[0][1].get("fault") == "own"):
        name, word = failed[0]
        return f"{name}: {word.get('reason', 'ended with code ' + str(word['exit_code']))}"
    if silent:
        return f"{' and '.join(silent)}: left no word of its end: not started, or killed"
    return None


def _outcome(words: Mapping[str, Word | None]) -> Outcome:
    said = {name: word for name, word in words.items() if word is not None}
    uses = [
        ProcessUse(name, word["exit_code"], word["cpu_s"], word["peak_bytes"])
        for name, word in said.items()
    ]
    wall_s = max((word["wall_s"] for word in said.values()), default=0.0)
    return Outcome(
        {"federates": wall_s},
        {name: word["granted_ns"] if word else -1 for name, word in words.items()},
        tuple(uses),
    )
