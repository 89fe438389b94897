"""Which frame is where: SDF's frame semantics.

Every model is a scope of its own with the implicit frame `__model__`, the world one with `world`. Names with `::`
reach down into nested models, never up. Source: SDF proposals "Pose Frame Semantics" (1.7, 1.8) and sdformat's
FrameSemantics.cc.
"""

from dataclasses import dataclass, field

from simscen.core.geometry import Pose3
from simscen.worlds.sdf import values
from simscen.worlds.sdf.markup import Element

MODEL, WORLD = "__model__", "world"


@dataclass(eq=False)
class Frame:
    """A frame by its `<pose>` (`given`; None = identity), one object for each time its file is included.

    The pose is relative to the frame it names, otherwise to `default`. `inner` is the scope of a model, whose frame
    `placement` is what the pose places. `attached_to` names the frame whose link this one moves with.
    """

    name: str
    element: Element
    given: Element | None
    default: str = ""
    attached_to: str = ""
    inner: "Scope | None" = None
    placement: str = ""


@dataclass(eq=False)
class Scope:
    """The frames of one model or of the world, whose own frame is called `implicit`.

    `merged` are models included with merge: their names are visible here too. `canonical` is the frame that the
    implicit one moves with; "" means the world.
    """

    implicit: str = MODEL
    canonical: str = ""
    frames: dict[str, Frame] = field(default_factory=dict)
    merged: list[Frame] = field(default_factory=list)
    _known: dict[int, Pose3] = field(default_factory=dict)
    _open: list[int] = field(default_factory=list)

    def add(self, frame: Frame) -> None:
        """Make a frame known by its name; the first of two with the same name keeps it."""
        self.frames.setdefault(frame.name, frame)

    def place(self, frame: Frame) -> Pose3:
        """`scope_from_frame`; raises Unusable for unknown frames and for cycles."""
        key = id(frame)
        if key not in self._known:
            where = frame.given or frame.element
            if key in self._open:
                raise where.unusable(f"the pose of {frame.name!r} depends on itself")
            self._open.append(key)
            try:
                self._known[key] = self._compose(frame, where)
            finally:
                self._open.pop()
        return self._known[key]

    def _compose(self, frame: Frame, where: Element) -> Pose3:
        origin = self.find(values.relative_to(frame.given) or frame.default, where)
        placed = origin.compose(values.pose(frame.given))
        if frame.inner is not None and frame.placement:
            placed = placed.compose(frame.inner.find(frame.placement, where).inverse())
        return placed

    def find(self, name: str, user: Element) -> Pose3:
        """`scope_from_name` of a frame that `user` mentions; raises Unusable when there is none."""
        if name in ("", self.implicit):
            return Pose3()
        if name in self.frames:
            return self.place(self.frames[name])
        owner, rest = self._below(name)
        if owner is None or owner.inner is None:
            raise user.unusable(f"unknown frame {name[:80]!r}")
        return self.place(owner).compose(owner.inner.find(rest, user))

    def link(self, name: str, user: Element, seen: tuple[Frame, ...] = ()) -> Frame | None:
        """The link that moves the frame `name`; None is the world. Raises Unusable when there is no such frame."""
        if name == WORLD:
            return None
        if name in ("", self.implicit):
            return self.link(self.canonical, user, seen) if self.canonical else None
        frame = self.frames.get(name)
        if frame is None:
            owner, rest = self._below(name)
            if owner is None or owner.inner is None:
                raise user.unusable(f"unknown link or frame {name[:80]!r}")
            return owner.inner.link(rest, user)
        if frame in seen:
            raise user.unusable(f"frame {name!r} is attached to itself")
        if frame.inner is not None:
            return frame.inner.link(MODEL, user)
        return frame if frame.element.tag == "link" else self.link(frame.attached_to, user, (*seen, frame))

    def _below(self, name: str) -> tuple[Frame | None, str]:
        """The nested or merged model that knows `name`, and the name it knows it by."""
        head, _, rest = name.partition("::")
        nested = self.frames.get(head)
        if rest and nested is not None and nested.inner is not None and nested.inner.knows(rest):
            return nested, rest
        for model in self.merged:
            if model.inner is not None and model.inner.knows(name):
                return model, name
        return None, name

    def knows(self, name: str) -> bool:
        """Whether `name` is a frame of this scope or below it."""
        return name == self.implicit or name in self.frames or self._below(name)[0] is not None
