"""Compute the poses of links in the world, from the poses of models and the `<state>` that Gazebo Classic saved.

Like Gazebo Classic, the importer applies the first `<state>` of a world. A state contains world poses of models, nested
models and links, which override the poses in the models.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field

from simscen.core.geometry import Pose3
from simscen.worlds.sdf.elements import MAX_COORDINATE_M, Element, read_numbers, read_pose
from simscen.worlds.sdf.frames import Frame
from simscen.worlds.sdf.model_tree import ModelNode
from simscen.worlds.sdf.report import ImportReport

Scale = tuple[float, float, float]
"""Factors for the sizes of shapes along x, y and z."""


@dataclass(frozen=True)
class ModelState:
    """Saved state of a model.

    pose:    pose of the model in the world; None if not saved
    links:   poses of the model's links in the world, by name
    models:  states of the nested models, by name
    scale:   factors for the shapes of the model's links; the poses are not scaled
    """

    pose: Pose3 | None = None
    links: dict[str, Pose3] = field(default_factory=dict)
    models: "dict[str, ModelState]" = field(default_factory=dict)
    scale: Scale = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class WorldState:
    """Saved state of a world.

    models:           states of models, by name
    deleted_names:    names of models that were deleted from the world
    inserted_models:  `<model>` elements that were inserted into the world
    """

    models: dict[str, ModelState] = field(default_factory=dict)
    deleted_names: frozenset[str] = frozenset()
    inserted_models: tuple[Element, ...] = ()


@dataclass(frozen=True, eq=False)
class PlacedLink:
    """A link with its pose in the world.

    name:   name as in Gazebo, for example model::nested::link
    frame:  frame of the link in its model
    model:  the model that contains the link directly
    pose:   pose in the world
    scale:  factors for the shapes of the link
    """

    name: str
    frame: Frame
    model: ModelNode
    pose: Pose3
    scale: Scale = (1.0, 1.0, 1.0)


def read_state(world: Element, report: ImportReport) -> WorldState:
    """Return the first `<state>` of a `<world>`; an empty WorldState if the world has no `<state>`."""
    states = list(world.all("state"))
    if not states:
        return WorldState()
    first = states[0]
    if len(states) > 1:
        report.note(states[1].location, "only the first <state> of a world is applied")
    deletions, insertions = first.child("deletions"), first.child("insertions")
    return WorldState(
        {model.name: _read_model_state(model, report) for model in first.all("model")},
        frozenset(name.text for name in deletions.all("name")) if deletions else frozenset(),
        tuple(insertions.all("model")) if insertions else (),
    )


def _read_model_state(element: Element, report: ImportReport) -> ModelState:
    """Return the state in a `<model>` of a `<state>`. Unusable values are added to the report and left out."""
    links: dict[str, Pose3] = {}
    models: dict[str, ModelState] = {}
    pose, scale = None, (1.0, 1.0, 1.0)
    for child in element.children:
        with report.skip_unusable():
            match child.tag:
                case "pose":
                    pose = read_pose(child)
                case "link":
                    if child.child("pose"):
                        links[child.name] = read_pose(child.child("pose"))
                case "model":
                    models[child.name] = _read_model_state(child, report)
                case "scale":
                    scale = _read_scale(child)
    return ModelState(pose, links, models, scale)


def _read_scale(element: Element) -> Scale:
    x, y, z = read_numbers(element, 3)
    if min(x, y, z) <= 0:
        raise element.unusable(f"a scale must be positive, got {element.text}")
    if max(x, y, z) > MAX_COORDINATE_M:
        raise element.unusable(f"a scale must be at most {MAX_COORDINATE_M:g}, got {element.text}")
    return x, y, z


def place_links(
    model: ModelNode, pose: Pose3, report: ImportReport, state: ModelState | None = None, scoped_name: str = ""
) -> Iterator[PlacedLink]:
    """Yield all links of a model at `pose` in the world, including the links of nested models.

    Poses in `state` override the poses in the model. Links without a valid pose are added to the report and left out.
    `scoped_name` is the name of a nested model, for example outer::nested.
    """
    state = state or ModelState()
    model_pose = state.pose if state.pose is not None else pose
    for part in model.parts:
        with report.skip_unusable():
            frame = part.frame if isinstance(part, ModelNode) else part
            part_pose = model_pose.compose(model.scope.pose_of(frame))
            name = f"{scoped_name or model.name}::{part.name}"
            if isinstance(part, ModelNode):
                nested_state = state.models.get(part.name, _state_of_included_model(state, part))
                yield from place_links(part, part_pose, report, nested_state, name)
            else:
                yield PlacedLink(name, part, model, state.links.get(part.name, part_pose), state.scale)


def _state_of_included_model(state: ModelState, model: ModelNode) -> ModelState:
    """Return the state of a nested model from the `state` of the outer model.

    Older versions of Gazebo Classic saved the links of an included model as `model::link` of the outer model.
    """
    prefix = f"{model.name}::"
    links = {name.removeprefix(prefix): pose for name, pose in state.links.items() if name.startswith(prefix)}
    return ModelState(scale=state.scale, links=links)
