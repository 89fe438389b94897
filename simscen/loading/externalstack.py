"""Whether anybody says what the external stack of a scenario runs."""

from collections.abc import Iterable
from pathlib import Path

from simscen.core.problems import Problem
from simscen.loading.loaded import LoadedScenario
from simscen.loading.messages import quoted, suggestion
from simscen.loading.robots import external_of
from simscen.loading.stackchoice import EXTERNAL
from simscen.model.anystack import ExternalStackSpec


def undefined(loaded: LoadedScenario, known: Iterable[str] = (), config: Path | None = None) -> Problem | None:
    """The problem of a scenario whose external stack has a name of which nobody says what it runs.

    `known` are the names of which somebody does; `config` is the file that could say so.
    """
    stack = loaded.spec.stack
    if not isinstance(stack, ExternalStackSpec) or loaded.runs is not None:
        return None
    name = stack.external
    near = suggestion(name, known)
    there = f", or under `stacks:` in {config}" if config is not None else ""
    hint = near if near.startswith("did") else f"say so with --stack {name}='COMMAND'{there}"
    message = f"nobody says what the stack {quoted(name)} runs"
    return loaded.problem(("stack", EXTERNAL), "SC060", message, hint)


def torn(loaded: LoadedScenario, given: Iterable[str], config: Path) -> list[Problem]:
    """The problem that several --stack, of which each is for a run of its own, say what robots of one run have.

    `given` are the names of which the command line says what they run.
    """
    own = {name: view for view in loaded.robots.values() if (name := external_of(view.tree)) is not None}
    said = [name for name in given if name in own]
    message = f"robots here have the stacks {' and '.join(map(quoted, said))}, but a run has one --stack"
    hint = f"say what all but one of them run under `stacks:` in {config}"
    return [own[said[1]].problem(("stack", EXTERNAL), "SC042", message, hint)] if len(said) > 1 else []
