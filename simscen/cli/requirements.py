"""Whether the installed packages are those that simscen was made for: others end in errors that name no reason."""

import re
from collections.abc import Iterator

TYPER = (0, 20)
"""The oldest typer that understands our options whatever click is installed, as in pyproject.toml."""

_COMPARE = {
    ">=": lambda have, want: have >= want,
    "<": lambda have, want: have < want,
    "==": lambda have, want: have == want,
    "!=": lambda have, want: have != want,
}
_CLAUSE = re.compile(r"(>=|<|==|!=)\s*([\w.]+)")


def unmet() -> list[str]:
    """What is missing or of a version that simscen does not work with, one sentence each."""
    from importlib.metadata import PackageNotFoundError, requires

    try:
        needed = requires("simscen") or []
    except PackageNotFoundError:  # run from a folder of sources: nothing says what it needs
        return []
    return [told for each in needed if "extra ==" not in each for told in _unmet(each)]


def unmet_typer() -> list[str]:
    """The same of typer alone, without the 20 ms that it takes to look into the others."""
    from typer import __version__

    wanted = f">={'.'.join(map(str, TYPER))}"
    return [] if _numbers(__version__) >= TYPER else [_told("typer", __version__, wanted)]


def _unmet(requirement: str) -> Iterator[str]:
    """For a requirement as pip writes it into metadata, e.g. `numpy<3,>=1.26`."""
    from importlib.metadata import PackageNotFoundError, version

    name = re.split(r"[\s<>=!;\[(]", requirement, maxsplit=1)[0]
    wanted = requirement[len(name) :].split(";", maxsplit=1)[0]
    try:
        have = version(name)
    except PackageNotFoundError:
        yield f"{name} is not installed: pip install {name!r}"
        return
    if not all(_COMPARE[sign](_numbers(have), _numbers(want)) for sign, want in _CLAUSE.findall(wanted)):
        yield _told(name, have, wanted.strip())


def _told(name: str, have: str, wanted: str) -> str:
    wanted = ",".join(sorted(wanted.split(","), reverse=True))
    return f"{name} {have} is installed, and simscen needs {name}{wanted}: pip install '{name}{wanted}'"


def _numbers(version: str) -> tuple[int, ...]:
    """Comparable: the numbers of a version without zeros at its end; 2.17.7.post6 is newer than 2.17.7."""
    numbers = [int(number) for number in re.findall(r"\d+", version.split("+", maxsplit=1)[0])]
    while numbers and numbers[-1] == 0:
        numbers.pop()
    return tuple(numbers)
