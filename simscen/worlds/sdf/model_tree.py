"""Read the tree of models in a world, and compute the poses of their frames.

An `<include>` is replaced by the model that it refers to. The world and each model are scopes for names of frames. The
scope's own frame is called `world` or `__model__`. Names with `::` refer to frames of nested models. Source: SDF
proposals "Pose Frame Semantics" (1.7, 1.8) and sdformat's FrameSemantics.cc.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field

from simscen.core.geometry import Pose3
from simscen.worlds.sdf.elements import (
    Element,
    checked_name,
    parse_bool,
    read_bool,
    read_pose,
    reference_frame,
    report_unknown,
    report_unknown_children,
)
from simscen.worlds.sdf.files import IncludedFiles
from simscen.worlds.sdf.report import ImportReport

MODEL_FRAME, WORLD_FRAME = "__model__", "world"
"""Names of the own frame of a model, and of the world."""
MAX_MODELS = 20_000
"""Maximum number of models, because files that include each other can multiply models."""


@dataclass(eq=False)
class Frame:
    """A named frame: of a link, a nested model, a joint, or a `<frame>` element.

    element:            the XML element; several frames can have the same one if a file is included several times
    pose:               the `<pose>` element; None for identity
    default_reference:  name of the frame that `pose` refers to if it has no `relative_to`; "" for the scope's own frame
    attached_to:        name of the link or frame with which a joint or a `<frame>` moves; "" for the scope's own frame
    model_scope:        the frames in a nested model; None if this is not the frame of a model
    placement_frame:    name of a frame in the nested model that `pose` places; "" if `pose` places the model itself
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
                self._poses[key] = self._compute_pose(frame, referrer)
            finally:
                self._frames_in_progress.pop()
        return self._poses[key]

    def _compute_pose(self, frame: Frame, referrer: Element) -> Pose3:
        reference = self.pose_of_name(reference_frame(frame.pose) or frame.default_reference, referrer)
        pose = reference.compose(read_pose(frame.pose))
        if frame.model_scope is not None and frame.placement_frame:
            pose = pose.compose(frame.model_scope.pose_of_name(frame.placement_frame, referrer).inverse())
        return pose

    def pose_of_name(self, name: str, referrer: Element) -> Pose3:
        """Return the pose of the frame `name`, which may be `model::frame`, relative to the scope's own frame.

        Raises UnusableElement at the element `referrer` if there is no such frame.
        """
        if name in ("", self.implicit_frame):
            return Pose3()
        if name in self.frames:
            return self.pose_of(self.frames[name])
        model, rest = self._model_with_frame(name)
        if model is None or model.model_scope is None:
            raise referrer.unusable(f"unknown frame {name[:80]!r}")
        return self.pose_of(model).compose(model.model_scope.pose_of_name(rest, referrer))

    def link_of_frame(self, name: str, referrer: Element, visited: tuple[Frame, ...] = ()) -> Frame | None:
        """Return the frame of the link with which the frame `name` moves; None for the world or a model without links.

        `visited` are the frames that lead to this one, to detect cycles. Raises UnusableElement at the element
        `referrer` if there is no such frame, or if it is attached to itself.
        """
        if name == WORLD_FRAME:
            return None
        if name in ("", self.implicit_frame):
            return self.link_of_frame(self.canonical_link, referrer, visited) if self.canonical_link else None
        frame = self.frames.get(name)
        if frame is None:
            model, rest = self._model_with_frame(name)
            if model is None or model.model_scope is None:
                raise referrer.unusable(f"unknown link or frame {name[:80]!r}")
            return model.model_scope.link_of_frame(rest, referrer)
        if frame in visited:
            raise referrer.unusable(f"frame {name!r} is attached to itself")
        if frame.model_scope is not None:
            return frame.model_scope.link_of_frame(MODEL_FRAME, referrer)
        if frame.element.tag == "link":
            return frame
        return self.link_of_frame(frame.attached_to, referrer, (*visited, frame))

    def _model_with_frame(self, name: str) -> tuple[Frame | None, str]:
        """Return the frame of the nested or merged model that contains the frame `name`, and the frame's name there.

        Returns None instead of the frame if there is no such model.
        """
        head, _, rest = name.partition("::")
        nested = self.frames.get(head)
        if rest and nested is not None and nested.model_scope is not None and nested.model_scope.has_frame(rest):
            return nested, rest
        for model in self.merged_models:
            if model.model_scope is not None and model.model_scope.has_frame(name):
                return model, name
        return None, name

    def has_frame(self, name: str) -> bool:
        """Return whether `name` is a frame of this scope or of a model in this scope."""
        return name == self.implicit_frame or name in self.frames or self._model_with_frame(name)[0] is not None


@dataclass(eq=False)
class ModelNode:
    """A model, an actor, or the world as the outermost model.

    frame:      frame of the model in the scope of its parent
    scope:      the frames in the model
    is_static:  whether the model or a model around it is static
    parts:      links (as frames) and nested models, in document order; an actor has only links
    joints:     `<joint>` elements
    actors:     actors of the world; empty for models
    """

    name: str
    element: Element
    frame: Frame
    scope: FrameScope
    is_static: bool = False
    parts: "list[Frame | ModelNode]" = field(default_factory=list)
    joints: list[Element] = field(default_factory=list)
    actors: "list[ModelNode]" = field(default_factory=list)

    def models(self) -> "Iterator[ModelNode]":
        """Yield this model and all models nested in it."""
        yield self
        for part in self.parts:
            if isinstance(part, ModelNode):
                yield from part.models()


class TreeReader:
    """Reads the trees of worlds and models. Unusable elements are added to the report and left out."""

    def __init__(self, included_files: IncludedFiles, report: ImportReport) -> None:
        self._included_files, self._report = included_files, report
        self._model_count = 0

    def read_world(self, element: Element) -> ModelNode:
        """Return the node of a `<world>` with its models and actors."""
        scope = FrameScope(WORLD_FRAME)
        world = ModelNode(element.name, element, Frame(WORLD_FRAME, element, None), scope)
        self._read_children(world, "world")
        return world

    def read_model(self, element: Element, is_parent_static: bool, include: Element | None = None) -> ModelNode:
        """Return the node of a `<model>`. Raises UnusableElement.

        The children name, pose, static and placement_frame of an `include` override the same children of the model.
        A merged model is static only if its parent is static.
        """
        self._model_count += 1
        if self._model_count > MAX_MODELS:
            raise element.unusable(f"more than {MAX_MODELS} models")
        overrides = {child.tag: child for child in include.children} if include else {}
        name = _checked_name(element, overrides.get("name"))
        is_static = read_bool(overrides.get("static", element.child("static")))
        if include is not None and _has_merge(include):
            is_static = False
        scope = FrameScope(MODEL_FRAME)
        frame = Frame(name, element, overrides.get("pose", element.child("pose")), model_scope=scope)
        placement = overrides.get("placement_frame")
        frame.placement_frame = placement.text if placement else element.attributes.get("placement_frame", "")
        model = ModelNode(name, element, frame, scope, is_parent_static or is_static)
        self._read_children(model, "model")
        scope.canonical_link = element.attributes.get("canonical_link", "") or scope.canonical_link
        return model

    def add_model(self, owner: ModelNode, model: ModelNode, is_merged: bool = False) -> None:
        """Add a nested model to its owner. The frames of a merged model are visible in the scope of the owner, too."""
        owner.parts.append(model)
        name = f"_merged__{model.name}__model__" if is_merged else model.name
        owner.scope.frames.setdefault(name, model.frame)
        owner.scope.canonical_link = owner.scope.canonical_link or name
        if is_merged:
            owner.scope.merged_models.append(model.frame)

    def _read_children(self, owner: ModelNode, kind: str) -> None:
        """Add the children of an element to the node `owner`; `kind` is "world", "model" or "actor"."""
        for child in owner.element.children:
            with self._report.skip_unusable():
                self._read_child(owner, kind, child)

    def _read_child(self, owner: ModelNode, kind: str, child: Element) -> None:
        pose, scope = child.child("pose"), owner.scope
        match kind, child.tag:
            case _, "frame":
                attached_to = child.attributes.get("attached_to", "")
                scope.add(Frame(checked_name(child), child, pose, attached_to, attached_to))
            case "world" | "model", "model":
                self.add_model(owner, self.read_model(child, owner.is_static))
            case "world" | "model", "include":
                self._read_include(owner, child)
            case "world" | "model", "joint":
                owner.joints.append(child)
                child_link = child.child("child")
                link = child_link.text if child_link else ""
                scope.add(Frame(checked_name(child), child, pose, link, link))
            case "model" | "actor", "link":
                frame = Frame(checked_name(child), child, pose)
                scope.add(frame)
                owner.parts.append(frame)
                scope.canonical_link = scope.canonical_link or frame.name
            case "world", "actor":
                owner.actors.append(self._read_actor(child))
            case "model", "state":
                self._report.note(child.location, "ignored: only the <state> of a world is applied")
            case "world", "population":
                raise child.unusable("<population> is not supported", "place its models one by one")
            case _:
                report_unknown(child, kind, self._report)

    def _read_actor(self, element: Element, include: Element | None = None) -> ModelNode:
        """Return the node of an `<actor>`. Name and pose of an `include` override the actor's own name and pose."""
        name = _checked_name(element, include.child("name") if include else None)
        pose = (include.child("pose") if include else None) or element.child("pose")
        scope = FrameScope(MODEL_FRAME)
        actor = ModelNode(name, element, Frame(name, element, pose, model_scope=scope), scope)
        self._read_children(actor, "actor")
        return actor

    def _read_include(self, owner: ModelNode, include: Element) -> None:
        """Add the first model or actor of another file to the owner. A light is ignored. Raises UnusableElement."""
        report_unknown_children(include, "include", self._report)
        root = self._included_files.enter(include)
        try:
            entities = list(root.all("model", "actor", "light", "world"))
            if not entities or entities[0].tag == "world":
                hint = "it contains a world" if entities else ""
                raise include.unusable(f"{root.source.name} contains no model", hint)
            if len(entities) > 1:
                self._report.note(root.location, "contains more than one model; only the first is included")
            first = entities[0]
            if first.tag == "model":
                self.add_model(owner, self.read_model(first, owner.is_static, include), _has_merge(include))
            elif first.tag == "actor":
                owner.actors.append(self._read_actor(first, include))
        finally:
            self._included_files.leave()


def _checked_name(element: Element, override: Element | None) -> str:
    """Return the text of the element `override` if given, otherwise the name of `element`."""
    return checked_name(override, override.text) if override else checked_name(element)


def _has_merge(include: Element) -> bool:
    return parse_bool(include.attributes.get("merge", "0"), include)
