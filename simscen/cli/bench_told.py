"""What the commands of `simscen bench` share: how they tell what they are doing and what they have found."""

import sys
from enum import Enum
from pathlib import Path
from typing import Any

from simscen.cli.bench_compare import as_text
from simscen.cli.bench_result import Result, as_json
from simscen.cli.diagnostics import print_text


class Format(str, Enum):
    """What is printed."""

    TEXT = "text"
    JSON = "json"


COMPARE = "A result of this command as JSON: what has changed since, and what of that is noise."


def tell(what: str) -> None:
    """Say on a terminal what is being measured."""
    if sys.stderr.isatty():
        print(f"\r\x1b[K{what}", end="", file=sys.stderr, flush=True)


def show(result: Result, text: str, sections: dict[str, Any], format_: Format, before: Result | None) -> None:
    """Print a result; as text also how it compares with one from before."""
    tell("")
    if format_ is Format.JSON:
        print(as_json(result, sections))
        return
    print_text(text)
    if before is not None:
        print_text("\n" + as_text(before, result))


def earlier(file: Path | None) -> Result | None:
    """The result to compare with, read before anything is measured. Raises UsageError."""
    from simscen.cli.bench_result import read_result

    return None if file is None else read_result(file)
