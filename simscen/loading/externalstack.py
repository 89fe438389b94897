"""Whether anybody says what the external stack of a scenario runs."""

from collections.abc import Iterable

from simscen.core.problems import Problem
from simscen.loading.loaded import LoadedScenario
from simscen.loading.messages import quoted, suggestion
from simscen.model.anystack import ExternalStackSpec


def undefined(loaded: LoadedScenario, known: Iterable[str] = ()) -> Problem | None:
    """The problem of a scenario whose external stack has a name of which nobody says what it runs.

    `known` are the names of which somebody does.
    """
    stack = loaded.spec.stack
    if not isinstance(stack, ExternalStackSpec) or loaded.runs is not None:
        return None
    name = stack.external
    near = suggestion(name, known)
    hint = near if near.startswith("did") else f"say so with --stack {name}='COMMAND'"
    message = f"nobody says what the stack {quoted(name)} runs"
    return loaded.problem(("stack", "external"), "SC060", message, hint)
