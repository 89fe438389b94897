"""Parameters of a stack where a scenario is asked for: told as what they are, and what they are for."""

from simscen.core.problems import Problem
from simscen.loading.nav2params import tells_nodes
from simscen.loading.tree import Fields, Node

STACK_FILE, PARAMETER_FILE = "stack file", "parameter file of Nav2"
_OF_A_STACK_FILE = frozenset({"simscen", "name", "description", "stack"})


def stranger(tree: Node | None, text: str, shown: str) -> str:
    """STACK_FILE or PARAMETER_FILE, if it is one of them; "" = anything else."""
    if tells_nodes(text, shown):
        return PARAMETER_FILE
    keys = set(tree.entries) if isinstance(tree, Fields) else set()
    return STACK_FILE if "stack" in keys <= _OF_A_STACK_FILE else ""


def no_scenario(kind: str, shown: str) -> Problem:
    """That a file of this kind is no scenario, and how scenarios are run with it."""
    written = f", or name it in a scenario: `stack: {{nav2_params: {shown.rpartition('/')[2]}}}`"
    hint = f"run scenarios with `--stack NAME={shown}`{written if kind == PARAMETER_FILE else ''}"
    return Problem(shown, 0, 0, "SC025", f"a {kind}, and no scenario", hint)
