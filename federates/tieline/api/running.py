"""Experiments: load one with settings of one's own, look at it, run it."""

import tempfile
from collections.abc import Callable, Mapping
from html import escape
from pathlib import Path
from typing import Any

import pandas as pd
import yaml

from tieline.api.results import Result
from tieline.api.settings import options, without_options
from tieline.errors import InputError
from tieline.experiment.launch import launch
from tieline.experiment.load import load_experiment, shipped_experiments
from tieline.experiment.plan import Plan, prepare
from tieline.experiment.run import check_target, default_target, execute
from tieline.experiment.sweep import Point
from tieline.experiment.sweep_run import Listener, run_sweep
from tieline.sweeps.start import runner_of, with_core
from tieline.yaml_lines import load as load_yaml

OnProgress = Callable[[str, float], None]
"""Is told the label of a run and the simulated time that it has reached, s."""

Reference = str | Path | Mapping[str, Any]


class Experiment:
    """A checked experiment, ready to run: one run, or those of a sweep.

    Attributes:
        plan: every run with all its settings, as the launcher takes it.
    """

    def __init__(self, plan: Plan) -> None:
        self.plan = plan

    @property
    def name(self) -> str:
        """Return its name."""
        return self.plan.study.name

    @property
    def question(self) -> str:
        """Return the question that it answers."""
        return self.plan.study.question

    @property
    def labels(self) -> list[str]:
        """Return what each run is called; the experiment's name where there is no sweep."""
        return [self._label(run.point) for run in self.plan.runs]

    @property
    def settings(self) -> dict[str, dict[str, Any]]:
        """Return every setting in force in each run, by its label."""
        runs = [run.point for run in self.plan.runs]
        return {self._label(point): point.experiment.model_dump(mode="json") for point in runs}

    def run(
        self,
        out: str | Path | None = None,
        progress: OnProgress | bool = False,
        *,
        jobs: int | None = None,
        scheduler: str | None = None,
    ) -> Result:
        """Run it as the command line does, in processes of its own, and return its result.

        Args:
            out: the result folder, new, empty or an earlier result; one in `results/` without it.
                A sweep goes on in its folder: points that are finished there are not run again.
            progress: True prints a line at each quarter; or a function of a run's label and the
                simulated time that it has reached, s.
            jobs: points of a sweep at once on this machine; without it, as many as suit it.
            scheduler: address of a Dask scheduler whose workers run the points instead.

        Raises:
            InputError: `out` holds something else, or no such jobs or scheduler can be.
            TielineError: a run failed; what it wrote is kept, marked incomplete.
        """
        if out is not None:
            check_target(Path(out))
        target = default_target(self.name) if out is None else Path(out)
        tell = self._lines() if progress is True else progress or None

        def on_progress(point: Point, time_s: float) -> None:
            if tell is not None:
                tell(self._label(point), time_s)

        if not self.plan.study.is_sweep:
            return Result(execute(self.plan, target, launch, on_progress))
        runner = runner_of(self.plan, jobs, scheduler)
        return Result(run_sweep(self.plan, target, runner, Listener(on_progress)))

    def _label(self, point: Point) -> str:
        return point.label or self.name

    def _lines(self) -> OnProgress:
        duration_s = {
            self._label(run.point): run.point.experiment.grid.duration for run in self.plan.runs
        }
        reached: dict[str, int] = {}

        def tell(label: str, time_s: float) -> None:
            quarter = int(4 * time_s / duration_s[label])
            if quarter > reached.get(label, 0):
                reached[label] = quarter
                print(f"{label}: {time_s:.1f} of {duration_s[label]:g} s")  # noqa: T201

        return tell

    def __repr__(self) -> str:
        return f"Experiment {self.name} ({', '.join(self.labels)}): {self.question}"

    def _repr_html_(self) -> str:
        runs = ", ".join(map(escape, self.labels))
        return (
            f"<p><b>{escape(self.name)}</b>: {escape(self.question)}</p>"
            f"<p>{len(self.labels)} to run: {runs}</p>"
        )


def load(
    reference: Reference, settings: Mapping[str, Any] | None = None, **groups: Any
) -> Experiment:
    """Return an experiment, checked whole with its case and network; nothing is started.

    Args:
        reference: name of a shipped experiment, path of a YAML file, or what such a file would
            hold, as a dictionary.
        settings: what to change, by dotted key: `{"network.mean_delay": "250 ms"}`.
        groups: the same as nested dictionaries: `grid={"duration": 5}`, `seed=2`.

    Raises:
        InputError: anything is wrong; every finding at once.
    """
    chosen = options(settings, groups)
    try:
        if isinstance(reference, Mapping):
            return _from_content(reference, chosen)
        return Experiment(prepare(with_core(load_experiment(str(reference), chosen))))
    except InputError as error:
        raise without_options(error) from None


def run(
    reference: Reference,
    settings: Mapping[str, Any] | None = None,
    *,
    out: str | Path | None = None,
    progress: OnProgress | bool = False,
    jobs: int | None = None,
    scheduler: str | None = None,
    **groups: Any,
) -> Result:
    """Run an experiment and return its result: `load` and `Experiment.run` in one.

    Raises:
        InputError: anything is wrong with the experiment, or `out` holds something else.
        TielineError: a run failed; what it wrote is kept, marked incomplete.
    """
    return load(reference, settings, **groups).run(out, progress, jobs=jobs, scheduler=scheduler)


def experiments() -> pd.DataFrame:
    """Return the shipped experiments by name, each with the question that it answers."""
    files = shipped_experiments()
    questions = [" ".join(load_yaml(path).data["question"].split()) for path in files]
    return pd.DataFrame(
        {"question": questions}, index=pd.Index([path.stem for path in files], name="experiment")
    )


def _from_content(content: Mapping[str, Any], chosen: list[str]) -> Experiment:
    """Return the experiment of a dictionary; paths in it count from the working folder."""
    try:
        text = yaml.safe_dump(dict(content), sort_keys=False)
    except yaml.YAMLError as error:
        raise InputError(f"the experiment holds what no YAML file can: {error}") from error
    with tempfile.NamedTemporaryFile("w", prefix=".tieline-", suffix=".yaml", dir=".") as file:
        file.write(text)
        file.flush()
        path = Path(file.name).resolve()
        try:
            return Experiment(prepare(with_core(load_experiment(str(path), chosen))))
        except InputError as error:
            raise InputError(_without_file(finding, path) for finding in error.findings) from None


def _without_file(finding: str, path: Path) -> str:
    """Return a finding without the place of a file that the user never saw."""
    _, found, after = finding.partition(f"{path.name}:")
    return after.partition(": ")[2] if found else finding
