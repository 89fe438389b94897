"""Frame semantics of SDF: the poses of frames relative to each other, and the links that frames are attached to.

Every model is a scope with the implicit frame `__model__`; the world is a scope with the frame `world`. Names with
`::` refer to nested models, never to enclosing ones. Source: SDF proposals "Pose Frame Semantics" (1.7, 1.8) and
sdformat's FrameSemantics.cc.
"""

from dataclasses import dataclass, field

from simscen.core.geometry import Pose3
from simscen.worlds.sdf.elements import Element, read_pose, reference_frame

MODEL_FRAME, WORLD_FRAME = "__model__", "world"


@dataclass(eq=False)
class Frame:
    """A named frame; a file that is included twice yields two frames.

    `pose` is the `<pose>` element (None = identity), relative to the frame that it names, otherwise to
    `default_reference`. The frame moves with the link or frame `attached_to`. For a model, `model_scope` holds its
    frames, and the pose places its frame `placement_frame`.
    """

    name: str
    element: Element
    pose: Element | None
    default_reference: str = ""
    attached_to: str = ""
    model_scope: "FrameScope | None" = None
    placement_frame: str = ""


@dataclass(eq=False)
class FrameScope:
    """The frames of one model or of the world.

    `implicit_frame` is the name of the scope's own frame, which moves with the frame `canonical`; "" is the world.
    The names in `merged_models` (included with merge="true") are visible in this scope too.
    """

    implicit_frame: str = MODEL_FRAME
    canonical: str = ""
    frames: dict[str, Frame] = field(default_factory=dict)
    merged_models: list[Frame] = field(default_factory=list)
    _poses: dict[int, Pose3] = field(default_factory=dict)
    _open_frames: list[int] = field(default_factory=list)

    def add(self, frame: Frame) -> None:
        """Add a frame; the first of two frames with the same name wins."""
        self.frames.setdefault(frame.name, frame)

    def pose_of(self, frame: Frame) -> Pose3:
        """Return `scope_from_frame`; raises UnusableElement for unknown frames and for cycles."""
        key = id(frame)
        if key not in self._poses:
            user = frame.pose or frame.element
            if key in self._open_frames:
                raise user.unusable(f"the pose of {frame.name!r} depends on itself")
            self._open_frames.append(key)
            try:
                self._poses[key] = self._compute_pose(frame, user)
            finally:
                self._open_frames.pop()
        return self._poses[key]

    def _compute_pose(self, frame: Frame, user: Element) -> Pose3:
        reference = self.pose_of_name(reference_frame(frame.pose) or frame.default_reference, user)
        pose = reference.compose(read_pose(frame.pose))
        if frame.model_scope is not None and frame.placement_frame:
            pose = pose.compose(frame.model_scope.pose_of_name(frame.placement_frame, user).inverse())
        return pose

    def pose_of_name(self, name: str, user: Element) -> Pose3:
        """Return `scope_from_name` for a frame name; raises UnusableElement at `user` if there is no such frame."""
        if name in ("", self.implicit_frame):
            return Pose3()
        if name in self.frames:
            return self.pose_of(self.frames[name])
        model, rest = self._model_with_frame(name)
        if model is None or model.model_scope is None:
            raise user.unusable(f"unknown frame {name[:80]!r}")
        return self.pose_of(model).compose(model.model_scope.pose_of_name(rest, user))

    def link_of_frame(self, name: str, user: Element, visited: tuple[Frame, ...] = ()) -> Frame | None:
        """Return the link that the frame `name` moves with, or None for the world.

        Raises UnusableElement at `user` if there is no such frame.
        """
        if name == WORLD_FRAME:
            return None
        if name in ("", self.implicit_frame):
            return self.link_of_frame(self.canonical, user, visited) if self.canonical else None
        frame = self.frames.get(name)
        if frame is None:
            model, rest = self._model_with_frame(name)
            if model is None or model.model_scope is None:
                raise user.unusable(f"unknown link or frame {name[:80]!r}")
            return model.model_scope.link_of_frame(rest, user)
        if frame in visited:
            raise user.unusable(f"frame {name!r} is attached to itself")
        if frame.model_scope is not None:
            return frame.model_scope.link_of_frame(MODEL_FRAME, user)
        if frame.element.tag == "link":
            return frame
        return self.link_of_frame(frame.attached_to, user, (*visited, frame))

    def _model_with_frame(self, name: str) -> tuple[Frame | None, str]:
        """Return the nested or merged model that has the frame `name`, and the frame's name in that model."""
        head, _, rest = name.partition("::")
        nested = self.frames.get(head)
        if rest and nested is not None and nested.model_scope is not None and nested.model_scope.has_frame(rest):
            return nested, rest
        for model in self.merged_models:
            if model.model_scope is not None and model.model_scope.has_frame(name):
                return model, name
        return None, name

    def has_frame(self, name: str) -> bool:
        """Return True if `name` is a frame of this scope or of a model in it."""
        return name == self.implicit_frame or name in self.frames or self._model_with_frame(name)[0] is not None
