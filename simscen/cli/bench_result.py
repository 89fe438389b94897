"""Results of `simscen bench` as files: what is written, and read again to be compared."""

import json
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from simscen.cli.machine import processor
from simscen.core.errors import UsageError
from simscen.run.figure import Figure, Figures

FORMAT = 1
"""Of the JSON; another number means that names or meanings have changed."""


@dataclass(frozen=True)
class Result:
    """What one call has measured, where and with which version of simscen."""

    figures: Figures
    machine: str
    simscen: str

    @classmethod
    def here(cls, figures: Figures) -> "Result":
        """Measured just now."""
        return cls(figures, processor(), version("simscen"))


def as_json(result: Result, sections: dict[str, Any] | None = None) -> str:
    """All numbers; `sections` are what they were worked out from."""
    told = {"simscen_bench": FORMAT, "simscen": result.simscen, "machine": result.machine}
    figures = {name: asdict(figure) for name, figure in result.figures.items()}
    return json.dumps({**told, "figures": figures, **(sections or {})}, indent=2)


def read_result(file: Path) -> Result:
    """A result that was written as JSON. Raises UsageError for what is none, or of another version."""
    try:
        text = file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        why = error.strerror if isinstance(error, OSError) else "no text"
        raise UsageError(f"cannot read {file}: {why}") from None
    try:
        told = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise UsageError(f"{file} is no result of `simscen bench --format json`: {error}") from None
    if not isinstance(told, dict) or "simscen_bench" not in told:
        raise UsageError(f"{file} is no result of `simscen bench --format json`: it has no key `simscen_bench`")
    if told["simscen_bench"] != FORMAT:
        other = f"format {told['simscen_bench']!r}, this version reads {FORMAT}"
        raise UsageError(
            f"{file} is a result of another version of simscen bench ({other}): measure again with this one"
        )
    try:
        figures = {str(name): _figure(entry) for name, entry in told["figures"].items()}
        return Result(figures, str(told["machine"]), str(told["simscen"]))
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise UsageError(f"{file} is a damaged result of simscen bench: {type(error).__name__} at {error}") from None


def _figure(entry: dict[str, Any]) -> Figure:
    rounds = tuple(float(value) for value in entry["rounds"])
    return Figure(float(entry["value"]), str(entry["unit"]), rounds, bool(entry["more_is_better"]))
