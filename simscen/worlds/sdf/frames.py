"""Compute the poses of the frames of models, and the links with which they move.

The world and each model are scopes for names of frames. The scope's own frame is called `world` or `__model__`. Names
with `::` refer to frames of nested models. Source: SDF proposals "Pose Frame Semantics" (1.7, 1.8) and sdformat's
FrameSemantics.cc.
"""

from dataclasses import dataclass, field

from simscen.core.geometry import Pose3
from simscen.worlds.sdf.elements import Element, read_pose, reference_frame

MODEL_FRAME, WORLD_FRAME = "__model__", "world"


@dataclass(eq=False)
class Frame:
    """A named frame: of a link, a nested model, a joint, or a `<frame>` element.

    element:          the XML element; several frames have the same element if a file is included several times
    pose:             the `<pose>` element; None for identity
    attached_to:      name of the link or frame with which a joint or a `<frame>` moves; also the reference of `pose` if
                      the `<pose>` has no `relative_to`; "" for the scope's own frame
    model_scope:      the frames in a nested model; None if this is not the frame of a model
    placement_frame:  name of a frame in the nested model that `pose` places; "" if `pose` places the model itself
    """

    name: str
    element: Element
    pose: Element | None
    attached_to: str = ""
    model_scope: "FrameScope | None" = None
    placement_frame: str = ""


@dataclass(eq=False)
class FrameScope:
    """The frames of one model or of the world, by name.

    implicit_frame:  name of the scope's own frame
    canonical_link:  name of the link, frame, or nested model with which the own frame moves; unused in the world
    merged_models:   models included with merge="true", whose frames are visible in this scope, too
    """

    implicit_frame: str = MODEL_FRAME
    canonical_link: str = ""
    frames: dict[str, Frame] = field(default_factory=dict)
    merged_models: list[Frame] = field(default_factory=list)
    _poses: dict[int, Pose3] = field(default_factory=dict)
    """Computed poses by the id of the frame."""
    _frames_in_progress: list[int] = field(default_factory=list)
    """Ids of the frames whose pose is being computed, to detect cycles."""

    def add(self, frame: Frame) -> None:
        """Add a frame, unless there is one with the same name."""
        self.frames.setdefault(frame.name, frame)

    def pose_of(self, frame: Frame) -> Pose3:
        """Return the pose of a frame of this scope, relative to the scope's own frame.

        Raises UnusableElement if the pose refers to an unknown frame or depends on itself.
        """
        key = id(frame)
        if key not in self._poses:
            referrer = frame.pose or frame.element
            if key in self._frames_in_progress:
                raise referrer.unusable(f"the pose of {frame.name!r} depends on itself")
            self._frames_in_progress.append(key)
            try:
                reference = self.pose_of_name(reference_frame(frame.pose) or frame.attached_to, referrer)
                pose = reference.compose(read_pose(frame.pose))
                if frame.model_scope is not None and frame.placement_frame:
                    pose = pose.compose(frame.model_scope.pose_of_name(frame.placement_frame, referrer).inverse())
                self._poses[key] = pose
            finally:
                self._frames_in_progress.pop()
        return self._poses[key]

    def pose_of_name(self, name: str, referrer: Element) -> Pose3:
        """Return the pose of the frame `name`, which may be `model::frame`, relative to the scope's own frame.

        Raises UnusableElement at the element `referrer` if there is no such frame.
        """
        if name in ("", self.implicit_frame):
            return Pose3()
        if name in self.frames:
            return self.pose_of(self.frames[name])
        model, inner_name = self._model_with_frame(name)
        if model is None or model.model_scope is None:
            raise referrer.unusable(f"unknown frame {name[:80]!r}")
        return self.pose_of(model).compose(model.model_scope.pose_of_name(inner_name, referrer))

    def link_of_frame(self, name: str, referrer: Element, visited: tuple[Frame, ...] = ()) -> Frame | None:
        """Return the frame of the link with which the frame `name` moves; None for the world or a model without links.

        `visited` are the frames that lead to this one, to detect cycles. Raises UnusableElement at the element
        `referrer` if there is no such frame, or if the frame is attached to itself.
        """
        if name == WORLD_FRAME:
            return None
        if name in ("", self.implicit_frame):
            return self.link_of_frame(self.canonical_link, referrer, visited) if self.canonical_link else None
        frame = self.frames.get(name)
        if frame is None:
            model, inner_name = self._model_with_frame(name)
            if model is None or model.model_scope is None:
                raise referrer.unusable(f"unknown link or frame {name[:80]!r}")
            return model.model_scope.link_of_frame(inner_name, referrer)
        if frame in visited:
            raise referrer.unusable(f"frame {name!r} is attached to itself")
        if frame.model_scope is not None:
            return frame.model_scope.link_of_frame(MODEL_FRAME, referrer)
        if frame.element.tag == "link":
            return frame
        return self.link_of_frame(frame.attached_to, referrer, (*visited, frame))

    def _model_with_frame(self, name: str) -> tuple[Frame | None, str]:
        """Return the frame of the nested or merged model that contains the frame `name`, and its name there.

        Returns None instead of the frame if there is no such model.
        """
        model_name, _, inner_name = name.partition("::")
        nested = self.frames.get(model_name)
        scope = nested.model_scope if nested is not None else None
        if inner_name and scope is not None and scope.has_frame(inner_name):
            return nested, inner_name
        for model in self.merged_models:
            if model.model_scope is not None and model.model_scope.has_frame(name):
                return model, name
        return None, name

    def has_frame(self, name: str) -> bool:
        """Return whether `name` is a frame of this scope or of a model in this scope."""
        return name == self.implicit_frame or name in self.frames or self._model_with_frame(name)[0] is not None
