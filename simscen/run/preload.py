"""Imports what the runs of a scenario are built of, once in the warm process rather than in each of its forks."""

from collections.abc import Iterable, Iterator, Mapping
from importlib import import_module

from pydantic import BaseModel

from simscen.model.recovery import Recovery
from simscen.run.prepare import Prepared
from simscen.spec.component import Component


def import_components(prepared: Prepared) -> None:
    """Import the components of its stacks and sensors that simscen ships."""
    for part in prepared.each.values():
        for module in own_modules(_components((part.stack, part.robot.sensors))):
            import_module(module)


def own_modules(components: Iterable[Component]) -> Iterator[str]:
    """Where those that simscen ships are; those of packages are only ever imported in the process of a run."""
    for component in components:
        module = component.component.partition(":")[0]
        if module.startswith("simscen."):
            yield module


def _components(value: object) -> Iterator[Component]:
    """All specifications of components in a specification."""
    if isinstance(value, Component):
        yield value
    inner: Iterable[object] = ()
    match value:
        case Recovery():  # which writes its behaviours as names
            inner = value.chosen()
        case BaseModel():
            inner = value.__dict__.values()
        case Mapping():
            inner = value.values()
        case list() | tuple():
            inner = value
    for one in inner:
        yield from _components(one)
