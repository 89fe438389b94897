"""Put poses in place of the names of places."""

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, TypeVar

from pydantic import BaseModel, RootModel

from simscen.core.errors import Problem
from simscen.loading.loaded import LoadedWorld
from simscen.loading.schema.messages import quoted, suggestion
from simscen.loading.spec_walk import Reference, references
from simscen.loading.yaml.tree import Key, Node, value_position
from simscen.spec.named_places import OrPlace
from simscen.spec.places import PoseSpec

Spec = TypeVar("Spec", bound=BaseModel)
Places = Mapping[str, PoseSpec]
NOWHERE = PoseSpec(x=0.0, y=0.0)
"""Where a place is that there is not: what names it is wrong, and goes nowhere."""
NO_WORLD = "name the world that has it with `world:`"
NO_PLACES = "there is none at all"


def places_of(world: LoadedWorld | None) -> Places:
    """The places of a world; those that can be named are all in its own file."""
    return world.spec.places if world is not None and world.spec is not None else {}


def resolve_places(spec: Spec, places: Places) -> Spec:
    """The specification with poses and points in place of the names of places; unknown ones are nowhere."""
    for reference, pose in _named(spec, places):
        spec = _put(spec, reference.keys, pose)
    return spec


def resolve_criteria_places(plain: dict[str, Any], spec: BaseModel, places: Places) -> dict[str, Any]:
    """What `spec` was read from, with poses and points in place of the names of places that its criteria use.

    Whoever judges a log by it has no world to look them up in.
    """
    for reference, pose in _named(spec, places):
        if "pass" in reference.keys[:3:2]:  # of the whole, or of one of several robots
            written = pose.model_dump() if isinstance(pose, BaseModel) else pose
            plain = _put(plain, reference.keys, written)
    return plain


def place_references(spec: BaseModel) -> Iterator[Reference]:
    """Where the name of a place stands instead of its pose."""
    return (reference for reference in references(spec) if isinstance(reference.mark, OrPlace))


def unknown_places(spec: BaseModel, tree: Node, known: Iterable[str], nothing: str = NO_PLACES) -> Iterator[Problem]:
    """What in `tree`, from which `spec` was read, names none of the `known` places; `nothing` hints where none is."""
    names = tuple(known)
    for reference in place_references(spec):
        if reference.name not in names:
            hint = suggestion(reference.name, (*names, *getattr(reference.mark, "besides", ()))) or nothing
            message = f"no place of the world is called {quoted(reference.name)}"
            yield Problem(*value_position(tree, reference.keys), code="SC030", message=message, hint=hint)


def _named(spec: BaseModel, places: Places) -> Iterator[tuple[Reference, Any]]:
    for reference in place_references(spec):
        assert isinstance(reference.mark, OrPlace)
        yield reference, reference.mark.of(places.get(reference.name, NOWHERE).at(reference.name))


def _put(holder: Any, keys: tuple[Key, ...], value: Any) -> Any:
    """The same with another value at `keys`."""
    if isinstance(holder, RootModel):
        return holder.model_copy(update={"root": _put(holder.root, keys, value)})
    if not keys:
        return value
    key, *below = keys
    if isinstance(holder, BaseModel):
        name = next(name for name, field in type(holder).model_fields.items() if key == (field.alias or name))
        return holder.model_copy(update={name: _put(getattr(holder, name), tuple(below), value)})
    changed = holder.copy()
    changed[key] = _put(holder[key], tuple(below), value)
    return changed
