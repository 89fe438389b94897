"""Replaces place names in a specification by the poses of these places."""

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
"""Pose that replaces the name of an unknown place, for which a problem is reported."""
NO_WORLD_HINT = "name its world with `world:`"
"""Hint for a place name in a file without a world."""
NO_PLACES_HINT = "the world has no places"
"""Hint for a place name in a world without places."""


def places_of(world: LoadedWorld | None) -> Places:
    """Return the places of a world; {} without a world."""
    return world.spec.places if world is not None and world.spec is not None else {}


def resolve_places(spec: Spec, places: Places) -> Spec:
    """Return a copy of a specification with poses and points instead of place names."""
    for reference, pose in _poses_of_references(spec, places):
        spec = _replace_at(spec, reference.keys, pose)
    return spec


def resolve_criteria_places(plain: dict[str, Any], spec: BaseModel, places: Places) -> dict[str, Any]:
    """Return the YAML data `plain` of the scenario `spec` with poses instead of place names in its criteria."""
    for reference, pose in _poses_of_references(spec, places):
        if "pass" in reference.keys[:3:2]:  # of the scenario, or of one of its robots
            written = pose.model_dump() if isinstance(pose, BaseModel) else pose
            plain = _replace_at(plain, reference.keys, written)
    return plain


def place_references(spec: BaseModel) -> Iterator[Reference]:
    """Yield the references to places in a specification."""
    return (reference for reference in references(spec) if isinstance(reference.annotation, PlaceAllowed))


def unknown_places(
    spec: BaseModel, tree: Node, known: Iterable[str], empty_hint: str = NO_PLACES_HINT
) -> Iterator[Problem]:
    """Yield a problem for each place name in `spec` that is not in `known`; `tree` is its YAML tree."""
    names = tuple(known)
    for reference in place_references(spec):
        if reference.name not in names:
            hint = suggestion(reference.name, (*names, *getattr(reference.annotation, "keywords", ()))) or empty_hint
            message = f"no place of the world is called {quoted(reference.name)}"
            yield Problem(*value_position(tree, reference.keys), code="SC030", message=message, hint=hint)


def _poses_of_references(spec: BaseModel, places: Places) -> Iterator[tuple[Reference, Any]]:
    """Yield the references to places, with the pose or point that replaces each of them."""
    for reference in place_references(spec):
        assert isinstance(reference.annotation, PlaceAllowed)
        yield (
            reference,
            reference.annotation.value_at(places.get(reference.name, PLACEHOLDER_POSE).with_place(reference.name)),
        )


def _replace_at(holder: Any, keys: Keys, value: Any) -> Any:
    """Return a copy of `holder` (a model, list, or dict) with `value` at `keys`."""
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
