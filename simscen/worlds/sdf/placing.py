"""From the tree of models to links that stand somewhere in the world."""

from collections.abc import Iterator
from dataclasses import dataclass

from simscen.core.geometry import Pose3
from simscen.worlds.sdf.frames import Frame
from simscen.worlds.sdf.report import Report
from simscen.worlds.sdf.state import ModelState, Scale
from simscen.worlds.sdf.tree import Model


@dataclass(frozen=True, eq=False)
class PlacedLink:
    """A link at `pose` in the world; `name` is scoped as Gazebo's: model::nested::link.

    `scale` is how much larger its shapes are than written.
    """

    name: str
    frame: Frame
    model: Model
    pose: Pose3
    scale: Scale = (1.0, 1.0, 1.0)


def place(model: Model, pose: Pose3, report: Report, state: ModelState | None = None) -> Iterator[PlacedLink]:
    """All links of a model that stands at `pose` in the world, unless the saved state moves it or one of its parts."""
    yield from _below(model, pose, model.name, report, state or ModelState())


def _below(model: Model, given: Pose3, scoped: str, report: Report, state: ModelState) -> Iterator[PlacedLink]:
    pose = state.pose if state.pose is not None else given
    for part in model.parts:
        with report.skipping():
            frame = part.frame if isinstance(part, Model) else part
            placed = pose.compose(model.scope.place(frame))
            name = f"{scoped}::{part.name}"
            if isinstance(part, Model):
                yield from _below(part, placed, name, report, state.models.get(part.name, _inlined(state, part)))
            else:
                yield PlacedLink(name, part, model, state.links.get(part.name, placed), state.scale)


def _inlined(state: ModelState, part: Model) -> ModelState:
    """Older Classic worlds call the links of an included model `model::link` in the state of its owner."""
    prefix = f"{part.name}::"
    return ModelState(
        scale=state.scale,
        links={name.removeprefix(prefix): pose for name, pose in state.links.items() if name.startswith(prefix)},
    )
