"""`simscen list`."""

from pathlib import Path
from typing import Annotated

import typer

from simscen.cli import completions
from simscen.cli.diagnostics import harmless, print_text
from simscen.core.errors import InvalidInput
from simscen.loading.files.discovery import default_root, discover
from simscen.loading.keywords import select
from simscen.loading.loaded import LoadedScenario
from simscen.loading.scenario import try_variations
from simscen.model.anystack import ExternalStackSpec


def command(
    paths: Annotated[
        list[Path], typer.Argument(help="Scenario files, or folders to search.", autocompletion=completions.scenarios)
    ],
    keyword: Annotated[str, typer.Option("-k", help="Parts of ids with and, or, not, as in pytest.")] = "",
    tag: Annotated[list[str] | None, typer.Option(help="Only scenarios with this tag; repeatable.")] = None,
    root: Annotated[Path | None, typer.Option(help="Files inside scenarios stay in this folder.")] = None,
    world_path: Annotated[list[Path] | None, typer.Option(help="Folder with worlds and models; repeatable.")] = None,
) -> None:
    """List the scenarios that a selection means.

    One line each, also for each variation: id, name, tags, the external stack that it names, and why it is skipped or
    expected to fail. Exit code 0; 2 if a scenario is invalid; 5 if nothing is selected.
    """
    home = root if root is not None else default_root(paths)
    tried = [try_variations(file, home, world_path or ()) for file in discover(paths, home)]
    if problems := [problem for found in tried if isinstance(found, list) for problem in found]:
        raise InvalidInput(problems)
    chosen = select([one for found in tried if isinstance(found, tuple) for one in found], keyword, tag or ())
    width = max(len(scenario.title) for scenario in chosen)
    for scenario in chosen:
        about = f"{scenario.spec.name or ''} {_tags(scenario)} {_stack(scenario)} {_excuse(scenario)}"
        print_text(f"{harmless(scenario.title):{width}}  {harmless(about)}".rstrip())


def _excuse(scenario: LoadedScenario) -> str:
    spec = scenario.spec
    if spec.skip is not None:
        return f"(skipped: {spec.skip})"
    return f"(expected to fail: {spec.expected.fail})" if spec.expected is not None else ""


def _stack(scenario: LoadedScenario) -> str:
    stacks = [view.spec.stack for view in scenario.each.values()]
    names = dict.fromkeys(stack.external for stack in stacks if isinstance(stack, ExternalStackSpec))
    return f"({'stack' if len(names) == 1 else 'stacks'} {', '.join(names)})" if names else ""


def _tags(scenario: LoadedScenario) -> str:
    return f"[{', '.join(scenario.spec.tags)}]" if scenario.spec.tags else ""
