"""Writer of results as Parquet tables: runs.parquet with a row per run, verdicts.parquet with a row per finding."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from simscen.core.errors import UsageError
from simscen.core.records.run_result import RunKey
from simscen.core.records.run_store import RunStore
from simscen.core.records.session_events import RunFinished
from simscen.report.results_json import in_order
from simscen.spec.quantities import si_number

RUNS_FILE, VERDICTS_FILE = "runs.parquet", "verdicts.parquet"
RUNS_PER_GROUP = 10_000
"""Number of runs whose rows are written together. Larger groups need more memory."""


def write_parquet(folder: Path, runs: Sequence[RunFinished], values: Mapping[RunKey, Mapping[str, Any]]) -> list[Path]:
    """Write both tables into `folder`, and return the paths of the files.

    `values` are the varied values of each run, by the path of the parameter in the scenario. Raises UsageError if
    pyarrow is not installed, and OSError if a file cannot be written.
    """
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError:
        raise UsageError("--parquet needs pyarrow; install it with: pip install pyarrow") from None
    folder.mkdir(parents=True, exist_ok=True)
    ordered = in_order(runs)
    metrics = sorted({name for run in ordered for name in run.result.metrics})
    paths = sorted({path for run_values in values.values() for path in run_values})
    numeric = {path for path in paths if all(_is_number(each[path]) for each in values.values() if path in each)}
    tables = {
        RUNS_FILE: pa.schema([
            *_fields(pa, "run:int64 scenario:string variation:string seed:int64 stack:string outcome:string"),
            *_fields(pa, "ended:string simulated_seconds:float64 wall_seconds:float64"),
            *_fields(pa, "error_kind:string error_message:string"),
            *[pa.field(f"metric_{name}", pa.float64()) for name in metrics],
            *[pa.field(f"value_{path}", pa.float64() if path in numeric else pa.string()) for path in paths],
        ]),
        VERDICTS_FILE: pa.schema([
            *_fields(pa, "run:int64 id:string criterion:string severity:string status:string what:string"),
            *_fields(pa, "margin:float64 value:float64 unit:string time:float64 x:float64 y:float64"),
        ]),
    }  # fmt: skip
    for name, schema in tables.items():
        with pq.ParquetWriter(folder / name, schema) as writer:
            for group in _groups(ordered):
                rows = (
                    [_run_row(number, run, values.get(run.key, {}), numeric) for number, run in group]
                    if name == RUNS_FILE
                    else [row for number, run in group for row in _verdict_rows(number, run)]
                )
                writer.write_table(pa.Table.from_pylist(rows, schema=schema))
    return [folder / name for name in tables]


def _fields(pa: Any, text: str) -> list[Any]:
    """Return the columns that a text such as "seed:int64 outcome:string" lists. `pa` is the module pyarrow."""
    return [pa.field(name, getattr(pa, kind)()) for name, _, kind in (word.partition(":") for word in text.split())]


def _groups(runs: RunStore) -> Iterator[Iterator[tuple[int, RunFinished]]]:
    """Yield groups of at most RUNS_PER_GROUP runs, each with its number. Without runs, yield one empty group."""
    for start in range(0, max(len(runs), 1), RUNS_PER_GROUP):
        yield enumerate(runs[start : start + RUNS_PER_GROUP], start)


def _run_row(number: int, run: RunFinished, values: Mapping[str, Any], numeric: set[str]) -> dict[str, Any]:
    """Return the row of a run. Varied values at a path in `numeric` become numbers in SI units, others become text."""
    result, error = run.result, run.result.error
    return {
        "run": number,
        "scenario": result.key.scenario,
        "variation": result.key.variation,
        "seed": result.key.seed,
        "stack": result.key.stack_name,
        "outcome": result.outcome.value,
        "ended": result.ended,
        "simulated_seconds": result.simulated,
        "wall_seconds": run.wall,
        "error_kind": None if error is None else error.kind,
        "error_message": None if error is None else error.message,
        **{f"metric_{name}": value for name, value in result.metrics.items()},
        **{
            f"value_{path}": float(si_number(value)) if path in numeric else str(value)
            for path, value in values.items()
        },
    }


def _verdict_rows(number: int, run: RunFinished) -> Iterator[dict[str, Any]]:
    """Yield a row for each finding of a run. `number` refers to the column `run` of runs.parquet."""
    for verdict in run.result.verdicts:
        for finding in verdict.findings:
            x, y = (None, None) if finding.place is None else finding.place
            yield {
                "run": number,
                "id": verdict.id,
                "criterion": verdict.criterion,
                "severity": verdict.severity,
                "status": finding.status.value,
                "what": finding.what,
                "margin": finding.margin,
                "value": finding.value,
                "unit": finding.unit,
                "time": None if finding.tick is None else finding.tick / run.result.tick_rate,
                "x": x,
                "y": y,
            }


def _is_number(value: Any) -> bool:
    """Return whether a varied value is a number or a quantity with a unit."""
    number = si_number(value)
    return isinstance(number, int | float) and not isinstance(number, bool)
