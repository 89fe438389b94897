"""Hooks of the pytest plug-in for scenarios (`pytest --simscen scenarios/`), and the fixture `simscen`.

Scenario files are collected below the paths of the ini option `simscen_paths` and, with --simscen, below the paths on
the command line. A scenario file that is an argument of pytest is always collected.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from simscen.pytesting import OUT_OPTION, positive_number

if TYPE_CHECKING:
    from pathlib import Path

    from simscen.pytesting.scenario_items import Simscen

SUFFIXES = (".scenario.yaml", ".scenario.yml")
"""Suffixes of scenario files."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the command-line options and ini options of the plug-in."""
    group = parser.getgroup("simscen")
    group.addoption(
        "--simscen",
        action="store_true",
        help="collect the *.scenario.yaml files below the given paths, with one item per run as in `simscen run`",
    )
    group.addoption(
        "--simscen-seed",
        type=positive_number,
        metavar="N",
        help="run scenarios with this seed instead of their own (ini: simscen_seed)",
    )
    group.addoption(
        "--simscen-repeat",
        type=positive_number,
        default=1,
        metavar="N",
        help="run scenarios with this many seeds in a row",
    )
    group.addoption(
        "--simscen-stack",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="run scenarios with this stack instead of their own, like --stack of `simscen run`; repeatable "
        "(ini: simscen_stack)",
    )
    group.addoption(
        "--simscen-out",
        metavar="DIR",
        help="output folder for logs and pictures of each session (ini: simscen_out; default: simscen-out)",
    )
    parser.addini("simscen_paths", "folders and files whose scenarios are collected without --simscen", "paths", [])
    parser.addini("simscen_seed", "like --simscen-seed", default="")
    parser.addini("simscen_stack", "like --simscen-stack, one per line", "linelist", [])
    parser.addini("simscen_world_path", "folders with worlds and models, like --world-path", "paths", [])
    parser.addini(OUT_OPTION, "like --simscen-out", default="")


def pytest_configure(config: pytest.Config) -> None:
    """Register the marker `simscen`, which all scenario items have."""
    config.addinivalue_line("markers", "simscen: all runs of scenarios; the tags of scenarios are markers as well")


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """Return a collector for a requested scenario file; None for any other file."""
    if not file_path.name.endswith(SUFFIXES) or not _is_requested(file_path, parent):
        return None
    from simscen.pytesting.scenario_items import ScenarioFile

    collected: pytest.Collector = ScenarioFile.from_parent(parent, path=file_path)
    return collected


def _is_requested(file: Path, parent: pytest.Collector) -> bool:
    """Return whether --simscen, the command line, or the ini option `simscen_paths` requests the scenario file."""
    config = parent.config
    if config.getoption("--simscen") or parent.session.isinitpath(file):
        return True
    return any(file.is_relative_to(path) for path in config.getini("simscen_paths"))


@pytest.hookimpl(optionalhook=True)
def pytest_configure_node(node: Any) -> None:
    """Pass the output folder to a worker of pytest-xdist, so that all workers use the same folder."""
    from simscen.pytesting.scenario_items import runner_of

    node.workerinput[OUT_OPTION] = str(runner_of(node.config).folder)


@pytest.fixture
def simscen(request: pytest.FixtureRequest, tmp_path: Path) -> Simscen:
    """Provide a callable that runs a scenario and returns its Run: `simscen("goal.scenario.yaml", seed=7)`."""
    from simscen.pytesting.scenario_items import Simscen

    return Simscen(request.path.parent, tmp_path, request.config.getini("simscen_world_path"))
