"""Events and faults of a scenario, as its logs contain them."""

from collections.abc import Iterator

import yaml

from simscen.core.records.disturbances import Disturbance
from simscen.loading.loaded import LoadedScenario
from simscen.loading.yaml.tree import Key, node_at


def disturbances_of(loaded: LoadedScenario) -> Iterator[Disturbance]:
    """Yield the events of a scenario, each followed by the steps of its sequence, and then the faults."""
    for step in loaded.spec.steps:
        when = "" if step.when is None else _one_line_yaml(loaded, *step.keys, "when")
        yield Disturbance(step.name, "event", when, step.required, _line(loaded, *step.keys), step.after)
    for index, entry in enumerate(loaded.spec.faults):
        when = "" if entry.when is None else _one_line_yaml(loaded, "faults", index, "when")
        yield Disturbance(entry.label, "fault", when, entry.required, _line(loaded, "faults", index))


def _one_line_yaml(loaded: LoadedScenario, *keys: Key) -> str:
    """Return the mapping at `keys` as one line of YAML without braces."""
    text = yaml.safe_dump(
        node_at(loaded.tree, keys).plain, default_flow_style=True, sort_keys=False, allow_unicode=True, width=10**9
    )
    return text.strip().removeprefix("{").removesuffix("}")


def _line(loaded: LoadedScenario, *keys: Key) -> int:
    """Return the line of the value at `keys`; 0 if the value is not in the scenario file itself."""
    position = loaded.position_of(*keys)
    return position.line if position.path == loaded.path else 0
