"""Checks that the installed packages have the versions that simscen requires."""

import operator
import re
from collections.abc import Iterator

MIN_TYPER = (0, 20)
"""Oldest supported version of typer (major, minor), as in pyproject.toml."""

_COMPARE = {">=": operator.ge, "<": operator.lt, "==": operator.eq, "!=": operator.ne}
"""Comparison of two versions by its operator in a requirement."""
_CLAUSE = re.compile(r"(>=|<|==|!=)\s*([\w.]+)")
"""One condition of a requirement: operator and version."""


def unmet_requirements() -> list[str]:
    """Return a message for each required package that is missing or has an unsupported version."""
    from importlib.metadata import PackageNotFoundError, requires

    try:
        requirements = requires("simscen") or []
    except PackageNotFoundError:  # run from a source folder without package metadata
        return []
    return [message for each in requirements if "extra ==" not in each for message in _unmet(each)]


def unmet_typer() -> list[str]:
    """Return a message if typer is too old. This is faster than `unmet_requirements`."""
    from typer import __version__

    required = f">={'.'.join(map(str, MIN_TYPER))}"
    return [] if _version_numbers(__version__) >= MIN_TYPER else [_mismatch("typer", __version__, required)]


def _unmet(requirement: str) -> Iterator[str]:
    """Yield a message if a requirement of package metadata, such as `numpy<3,>=1.26`, is not met."""
    from importlib.metadata import PackageNotFoundError, version

    name = re.split(r"[\s<>=!;\[(]", requirement, maxsplit=1)[0]
    required = requirement[len(name) :].split(";", maxsplit=1)[0]
    try:
        installed = version(name)
    except PackageNotFoundError:
        yield f"{name} is not installed: pip install {name!r}"
        return
    numbers = _version_numbers(installed)
    if not all(_COMPARE[sign](numbers, _version_numbers(bound)) for sign, bound in _CLAUSE.findall(required)):
        yield _mismatch(name, installed, required.strip())


def _mismatch(name: str, installed: str, required: str) -> str:
    required = ",".join(sorted(required.split(","), reverse=True))
    return f"{name} {installed} is installed, but simscen needs {name}{required}: pip install '{name}{required}'"


def _version_numbers(version: str) -> tuple[int, ...]:
    """Return the numbers of a version without trailing zeros: (2, 17, 7, 6) for 2.17.7.post6."""
    numbers = [int(number) for number in re.findall(r"\d+", version.split("+", maxsplit=1)[0])]
    while numbers and numbers[-1] == 0:
        numbers.pop()
    return tuple(numbers)
