"""A result folder as pandas tables, or as an xarray dataset."""

from collections.abc import Mapping
from functools import cached_property
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from tieline.errors import InputError
from tieline.experiment.results import Run, read_manifest, read_runs
from tieline.experiment.table import FIELDS, value
from tieline.problems import near

if TYPE_CHECKING:
    import xarray as xr


class Result:
    """The folder of a run, or of a sweep; tables are read when they are asked for.

    Args:
        folder: a result folder, complete or not.

    Raises:
        InputError: the folder is no result.
    """

    def __init__(self, folder: str | Path) -> None:
        self.folder = Path(folder)
        self.manifest: Mapping[str, Any] = read_manifest(self.folder)

    @property
    def name(self) -> str:
        """Return the experiment's name."""
        return str(self.manifest["name"])

    @property
    def question(self) -> str:
        """Return the question that it answers."""
        return str(self.manifest["question"])

    @property
    def is_sweep(self) -> bool:
        """Return whether it holds the runs of a sweep."""
        return bool(self.manifest["kind"] == "sweep")

    @property
    def is_complete(self) -> bool:
        """Return whether every run reached its end."""
        return bool(self.manifest["status"] == "complete")

    @property
    def reason(self) -> str | None:
        """Return why it is incomplete; None where it is whole."""
        reason: str | None = self.manifest["reason"]
        return reason

    @cached_property
    def points(self) -> dict[str, "Result"]:
        """Return the runs by their label, in the sweep's order; of a single run, itself."""
        if not self.is_sweep:
            return {self._run.label: self}
        return {run.label: Result(run.folder) for run in read_runs(self.folder)}

    @property
    def config(self) -> Mapping[str, Any]:
        """Return every setting that was in force in a run."""
        return self._run.config

    @property
    def summary(self) -> Mapping[str, Any]:
        """Return the numbers of a run: frequency, swing, delay, packets, age, voltage, times."""
        return self._run.summary()

    def table(self) -> pd.DataFrame:
        """Return the closing table in SI units: a row a run that is complete, by its label."""
        whole = {label: run for label, run in self.points.items() if run.is_complete}
        rows = [
            {field.name: value(run.summary, field) for field in FIELDS} for run in whole.values()
        ]
        index = pd.Index(list(whole), name="run")
        return pd.DataFrame(rows, index=index, columns=[field.name for field in FIELDS])

    @cached_property
    def tables(self) -> list[str]:
        """Return the names of the tables that a run has written, for `read`."""
        return sorted(path.stem for path in self._run.folder.glob("*.parquet"))

    def read(self, name: str, *columns: str) -> pd.DataFrame:
        """Return a table of a run, or some of its columns; `tables` has the names.

        Raises:
            InputError: there is no such table or column, or this is a sweep.
        """
        if name not in self.tables:
            raise InputError(
                f"{self.folder}: no table '{name}'{near(name, self.tables)}"
                f" (it has: {', '.join(self.tables)})"
            )
        known = self._run.columns(name)
        unknown = [column for column in columns if column not in known]
        if unknown:
            raise InputError(
                f"{self.folder}: table '{name}' has no column '{column}'{near(column, known)}"
                for column in unknown
            )
        return self._run.table(name, *columns)

    @cached_property
    def grid(self) -> pd.DataFrame:
        """Return what the grid recorded, by `t_s`: columns such as `speed_pu.G26`, `f_hz.B61`."""
        return self.read("grid").set_index("t_s")

    @property
    def flows(self) -> pd.DataFrame:
        """Return what became of the packets from each PMU to each controller, a row a flow."""
        return self.read("flows")

    @property
    def links(self) -> pd.DataFrame:
        """Return what each link carried and dropped, a row a direction."""
        return self.read("links")

    @property
    def events(self) -> pd.DataFrame:
        """Return what happened in the grid, by `t_s`."""
        return self.read("events").set_index("t_s")

    def damping(self, *units: str) -> pd.DataFrame:
        """Return the damping coefficient D(t) of units, by `t_s`, pu on each machine's base.

        Args:
            units: their names; the five that vary most without any.

        Raises:
            InputError: there is no such unit, or this is a sweep.
        """
        from tieline.linear.damping import damping_coefficients

        time_s, found = damping_coefficients(self._run.folder, units)
        return pd.DataFrame(found, index=pd.Index(time_s, name="t_s"))

    def to_xarray(self) -> "xr.Dataset":
        """Return what the grid recorded, over `t_s`, `unit` and `bus`; of a sweep, over `run` too.

        Needs the extra: `pip install 'tieline[xarray]'`.

        Raises:
            InputError: xarray is not installed.
        """
        from tieline.api.labelled import along_runs, dataset

        if self.is_sweep:
            whole = {label: run for label, run in self.points.items() if run.is_complete}
            return along_runs({label: run.to_xarray() for label, run in whole.items()})
        return dataset(self._run.folder / "grid.parquet")

    @cached_property
    def _run(self) -> Run:
        if self.is_sweep:
            labels = ", ".join(repr(label) for label in self.points)
            raise InputError(f"{self.folder} is a sweep: take one of its points ({labels})")
        return Run(self.folder, self.manifest)

    def __repr__(self) -> str:
        what = f"{len(self.points)} runs" if self.is_sweep else "a run"
        state = "" if self.is_complete else f", incomplete: {self.reason}"
        return f"Result {self.name} ({what} in {self.folder}{state})"

    def _repr_html_(self) -> str:
        table = self.table().dropna(axis="columns", how="all")
        state = "" if self.is_complete else f"<p><b>incomplete</b>: {escape(str(self.reason))}</p>"
        shown: str = table.to_html(float_format="{:.4g}".format, border=0)
        return (
            f"<p><b>{escape(self.name)}</b>: {escape(self.question)}</p>{state}{shown}"
            f"<p><code>{escape(str(self.folder))}</code></p>"
        )


def open_result(folder: str | Path) -> Result:
    """Return the result in a folder: of a run, of a sweep, or of one point of a sweep.

    Raises:
        InputError: the folder is no result.
    """
    return Result(folder)
