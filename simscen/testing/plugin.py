"""Pytest plug-in for contracts: `pytest --simscen-contract my_package:MyPlanner` checks all promises of a component.

A promise is one rule of the protocol of the component, such as "the same seed gives the same path".
"""

from __future__ import annotations

import math
import traceback
from argparse import ArgumentTypeError
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from pathlib import Path

    from simscen.testing.contracts.base import Promise

pytest_plugins = ("simscen.pytesting.plugin",)
"""Plug-in that collects scenario files. pytest loads the plug-in by name, because this package must not import it."""

_PROMISES: pytest.StashKey[list[Promise]] = pytest.StashKey()


def _positive_seconds(text: str) -> float:
    """Convert the value of an option to seconds. Raises ArgumentTypeError if it is not a positive finite number."""
    try:
        seconds = float(text)
    except ValueError:
        seconds = math.nan
    if not 0.0 < seconds < math.inf:
        raise ArgumentTypeError(f"{text!r} is not a positive number of seconds")
    return seconds


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options --simscen-contract and --simscen-contract-limit."""
    group = parser.getgroup("simscen", "contracts of simscen's plug-ins")
    group.addoption(
        "--simscen-contract",
        action="append",
        default=[],
        metavar="TARGET",
        help="check all promises of a component: package.module:Class or the name of an entry point (repeatable); "
        "TARGET={JSON} sets values of its specification; without paths, nothing else runs",
    )
    group.addoption(
        "--simscen-contract-limit",
        type=_positive_seconds,
        default=60.0,
        metavar="SECONDS",
        help="wall time after which a promise counts as broken because the component does not return (default: 60)",
    )


def pytest_configure(config: pytest.Config) -> None:
    """Find the promises of all --simscen-contract targets. Without paths on the command line, test nothing else.

    Raises UsageError for an invalid target.
    """
    targets: list[str] = config.getoption("--simscen-contract")
    if not targets:
        return
    from simscen.testing.targets import InvalidTarget, promises_of_target

    try:
        config.stash[_PROMISES] = [promise for target in targets for promise in promises_of_target(target)]
    except InvalidTarget as error:
        raise pytest.UsageError(f"--simscen-contract {error}") from error
    if config.args_source is not pytest.Config.ArgsSource.ARGS:
        config.args[:] = []


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(session: pytest.Session, config: pytest.Config, items: list[pytest.Item]) -> None:
    """Add one test item for each promise, before other plug-ins select items. Each component has its own collector."""
    limit = config.getoption("--simscen-contract-limit")
    collectors: dict[str, SubjectCollector] = {}
    for promise in config.stash.get(_PROMISES, []):
        title = f"{promise.role} {promise.subject}"
        if title not in collectors:
            collectors[title] = SubjectCollector.from_parent(session, name=title, nodeid=title)
        items.append(PromiseItem.from_parent(collectors[title], name=promise.name, promise=promise, limit=limit))


class SubjectCollector(pytest.Collector):
    """Parent of the items of one component."""

    def collect(self) -> list[pytest.Item]:
        """Return no items, because `pytest_collection_modifyitems` adds them."""
        return []


class PromiseItem(pytest.Item):
    """Test of one promise."""

    def __init__(self, *, promise: Promise, limit: float, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self._promise, self._limit = promise, limit

    def runtest(self) -> None:
        """Check the promise within the limit. Raises PromiseBroken."""
        self._promise.check(self._limit)

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: Any = None) -> Any:
        """Return the observation and the promise; if the component raised an exception, also the traceback."""
        from simscen.testing.contracts.base import PromiseBroken

        if not isinstance(excinfo.value, PromiseBroken):
            return super().repr_failure(excinfo)
        lines = [f"{self._promise.subject}: {excinfo.value}", f"promised: {self._promise.verify.__doc__}"]
        if (cause := excinfo.value.__cause__) is not None:
            lines += ["", *traceback.format_exception(cause)]
        return "\n".join(lines).rstrip()

    def reportinfo(self) -> tuple[Path, int | None, str]:
        """Return file, no line, and the promise as a sentence."""
        return self.path, None, f"{self._promise.role} {self._promise}"
