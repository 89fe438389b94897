"""Command `simscen list`, which lists the scenarios that a selection matches."""

from pathlib import Path
from typing import Annotated

import typer

from simscen.cli import completions
from simscen.cli.diagnostics import escaped, print_text, relative_to_working_folder
from simscen.cli.shared_options import RootOption, WorldPathOption
from simscen.core.errors import InvalidInput
from simscen.loading.files.discovery import default_root, discover
from simscen.loading.keywords import select
from simscen.loading.loaded import LoadedScenario
from simscen.loading.scenario import try_variations
from simscen.model.stack_files import ExternalStackSpec


def command(
    paths: Annotated[
        list[Path], typer.Argument(help="Scenario files, or folders to search.", autocompletion=completions.scenarios)
    ],
    keyword: Annotated[
        str, typer.Option("-k", help='Select ids by an expression, as in pytest: "faults and not slip".')
    ] = "",
    tag: Annotated[list[str] | None, typer.Option(help="Select scenarios with this tag; repeatable.")] = None,
    root: RootOption = None,
    world_path: WorldPathOption = None,
) -> None:
    """List the scenarios that a selection matches.

    Prints one line for each scenario and variation: id, name, tags, external stack, and the reason if the scenario is
    skipped or expected to fail. Exit code 0: listed; 2: a scenario is invalid; 5: nothing is selected.
    """
    root_folder = root or default_root(paths)
    results = [try_variations(file, root_folder, world_path or ()) for file in discover(paths, root_folder)]
    if problems := [problem for result in results if isinstance(result, list) for problem in result]:
        raise InvalidInput(relative_to_working_folder(problems, root_folder))
    scenarios = [scenario for result in results if isinstance(result, tuple) for scenario in result]
    selected = select(scenarios, keyword, tag or ())
    width = max(len(scenario.title) for scenario in selected)
    for scenario in selected:
        tags = f"[{', '.join(scenario.spec.tags)}]" if scenario.spec.tags else ""
        details = f"{scenario.spec.name or ''} {tags} {_stack(scenario)} {_expectation(scenario)}"
        print_text(f"{escaped(scenario.title):{width}}  {escaped(details)}".rstrip())


def _expectation(scenario: LoadedScenario) -> str:
    """Return the reason why the scenario is skipped or expected to fail; "" without a reason."""
    spec = scenario.spec
    if spec.skip is not None:
        return f"(skipped: {spec.skip})"
    return f"(expected to fail: {spec.expected.fail})" if spec.expected is not None else ""


def _stack(scenario: LoadedScenario) -> str:
    """Return the names of the scenario's external stacks; "" without external stacks."""
    stacks = [view.spec.stack for view in scenario.robot_views.values()]
    names = dict.fromkeys(stack.external for stack in stacks if isinstance(stack, ExternalStackSpec))
    return f"({'stack' if len(names) == 1 else 'stacks'} {', '.join(names)})" if names else ""
