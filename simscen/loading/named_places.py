"""Replace the names of places in a specification by the poses of these places."""

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, TypeVar

from pydantic import BaseModel, RootModel

from simscen.core.errors import Problem
from simscen.loading.loaded import LoadedWorld
from simscen.loading.schema.messages import quoted, suggestion
from simscen.loading.spec_walk import Reference, references
from simscen.loading.yaml.tree import Keys, Node, value_position
from simscen.spec.places import PlaceAllowed, PoseSpec

Spec = TypeVar("Spec", bound=BaseModel)
Places = Mapping[str, PoseSpec]
"""Poses of places by name."""
PLACEHOLDER_POSE = PoseSpec(x=0.0, y=0.0)
"""Pose that replaces the name of an unknown place, so that loading can go on. A problem is reported for the name."""
NO_WORLD_HINT = "name its world with `world:`"
NO_PLACES_HINT = "the world has no places"
"""Hints for names of places if there are no places."""


def places_of(world: LoadedWorld | None) -> Places:
    """Return the places of a world; {} without a world. Only world files of simscen can define places."""
    return world.spec.places if world is not None and world.spec is not None else {}


def resolve_places(spec: Spec, places: Places) -> Spec:
    """Return the specification with poses and points instead of the names of places."""
    for reference, pose in _poses_of_references(spec, places):
        spec = _replace_at(spec, reference.keys, pose)
    return spec


def resolve_criteria_places(plain: dict[str, Any], spec: BaseModel, places: Places) -> dict[str, Any]:
    """Return `plain`, the YAML data of `spec`, with poses and points instead of the names of places in criteria.

    Logs contain these data. They are judged without a world, so their criteria cannot refer to its places.
    """
    for reference, pose in _poses_of_references(spec, places):
        if "pass" in reference.keys[:3:2]:  # of the scenario, or of one of its robots
            written = pose.model_dump() if isinstance(pose, BaseModel) else pose
            plain = _replace_at(plain, reference.keys, written)
    return plain


def place_references(spec: BaseModel) -> Iterator[Reference]:
    """Yield the references to places in a specification."""
    return (reference for reference in references(spec) if isinstance(reference.mark, PlaceAllowed))


def unknown_places(
    spec: BaseModel, tree: Node, known: Iterable[str], nothing: str = NO_PLACES_HINT
) -> Iterator[Problem]:
    """Yield a problem for each name of a place that is not in `known`; `nothing` is the hint if there are no places."""
    names = tuple(known)
    for reference in place_references(spec):
        if reference.name not in names:
            hint = suggestion(reference.name, (*names, *getattr(reference.mark, "keywords", ()))) or nothing
            message = f"no place of the world is called {quoted(reference.name)}"
            yield Problem(*value_position(tree, reference.keys), code="SC030", message=message, hint=hint)


def _poses_of_references(spec: BaseModel, places: Places) -> Iterator[tuple[Reference, Any]]:
    """Yield each reference to a place, and the pose or point that replaces it."""
    for reference in place_references(spec):
        assert isinstance(reference.mark, PlaceAllowed)
        yield (
            reference,
            reference.mark.value_at(places.get(reference.name, PLACEHOLDER_POSE).with_place(reference.name)),
        )


def _replace_at(holder: Any, keys: Keys, value: Any) -> Any:
    """Return a copy of `holder`, a model, list, or dict, with `value` at `keys`."""
    if isinstance(holder, RootModel):
        return holder.model_copy(update={"root": _replace_at(holder.root, keys, value)})
    if not keys:
        return value
    key, *below = keys
    if isinstance(holder, BaseModel):
        name = next(name for name, field in type(holder).model_fields.items() if key == (field.alias or name))
        return holder.model_copy(update={name: _replace_at(getattr(holder, name), tuple(below), value)})
    changed = holder.copy()
    changed[key] = _replace_at(holder[key], tuple(below), value)
    return changed
