"""People and other things of one name: who comes would replace what is there, or the other of them."""

from collections.abc import Iterator

from simscen.core.problems import Problem
from simscen.core.world import World
from simscen.loading.loaded import LoadedScenario
from simscen.loading.messages import quoted
from simscen.loading.names import standing


def namesakes(loaded: LoadedScenario, world: World | None = None) -> Iterator[Problem]:
    """Pedestrians, and those of crowds, who are called like something of the world or like one who comes before."""
    taken = dict.fromkeys(standing(loaded, world), "something of the world")
    for step in loaded.spec.steps:
        for keys, action in step.placed():
            if action.kind not in ("spawn", "pedestrian", "crowd"):
                continue
            names = getattr(action.chosen, "names", None) or [getattr(action.chosen, "name", "")]
            twice = [name for name in names if name in taken]
            if twice and (action.kind != "spawn" or taken[twice[0]] == "somebody"):
                message = f"{taken[twice[0]]} is called {quoted(twice[0])} already"
                yield loaded.problem((*keys, action.kind, "name"), "SC033", message, "give one of them another name")
            taken.update(dict.fromkeys(names, "something" if action.kind == "spawn" else "somebody"))
