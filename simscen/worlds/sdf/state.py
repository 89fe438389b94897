"""`<state>`: where Gazebo Classic last saw everything, which is where it puts it again.

Classic applies the first `<state>` of a world after loading it: model, nested model and link poses in it are world
poses and override what the models say (World::Load, Model::SetState). The new Gazebo ignores it, yet worlds that have
a `<state>` were drawn in Classic.
"""

from dataclasses import dataclass, field

from simscen.core.geometry import Pose3
from simscen.worlds.sdf import values
from simscen.worlds.sdf.markup import Element
from simscen.worlds.sdf.report import Report

Scale = tuple[float, float, float]


@dataclass(frozen=True)
class ModelState:
    """Where a model, its links and nested models were, all in the world frame; None = nothing said.

    `scale` is how much larger the shapes of its links are than its geometry says; their places stay.
    """

    pose: Pose3 | None = None
    links: dict[str, Pose3] = field(default_factory=dict)
    models: "dict[str, ModelState]" = field(default_factory=dict)
    scale: Scale = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class WorldState:
    """The states of models by name, models that were `deleted`, and `inserted` ones as they were written."""

    models: dict[str, ModelState] = field(default_factory=dict)
    deleted: frozenset[str] = frozenset()
    inserted: tuple[Element, ...] = ()


def read_state(world: Element, report: Report) -> WorldState:
    """The state of a `<world>`; empty when it has none."""
    states = list(world.all("state"))
    if not states:
        return WorldState()
    first = states[0]
    if len(states) > 1:
        report.note(states[1].place, "only the first <state> of a world is applied")
    deletions, insertions = first.child("deletions"), first.child("insertions")
    return WorldState(
        {model.name: _model(model, report) for model in first.all("model")},
        frozenset(name.text for name in deletions.all("name")) if deletions else frozenset(),
        tuple(insertions.all("model")) if insertions else (),
    )


def _model(element: Element, report: Report) -> ModelState:
    links: dict[str, Pose3] = {}
    models: dict[str, ModelState] = {}
    pose, scale = None, (1.0, 1.0, 1.0)
    for child in element.children:
        with report.skipping():
            match child.tag:
                case "pose":
                    pose = values.pose(child)
                case "link":
                    if child.child("pose"):
                        links[child.name] = values.pose(child.child("pose"))
                case "model":
                    models[child.name] = _model(child, report)
                case "scale":
                    scale = _scale(child)
    return ModelState(pose, links, models, scale)


def _scale(element: Element) -> Scale:
    """How much larger the collisions are than written: Classic saves their sizes divided by the scale it saves."""
    x, y, z = values.numbers(element, 3)
    if min(x, y, z) <= 0:
        raise element.unusable(f"a scale must be positive, got {element.text}")
    return x, y, z
