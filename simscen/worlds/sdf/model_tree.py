"""Tree of models in a world, with every `<include>` replaced by the model that it refers to."""

from collections.abc import Iterator
from dataclasses import dataclass, field

from simscen.worlds.sdf.elements import Element, checked_name, parse_bool, read_bool
from simscen.worlds.sdf.files import IncludedFiles
from simscen.worlds.sdf.frames import MODEL_FRAME, WORLD_FRAME, Frame, FrameScope
from simscen.worlds.sdf.known_elements import report_unknown, report_unknown_children
from simscen.worlds.sdf.report import ImportReport

MAX_MODELS = 20_000
"""Limit against exponential growth, e.g. files that include ten others at every level."""


@dataclass(eq=False)
class ModelNode:
    """A model, an actor, or the world as the outermost model.

    `parts` are its links (Frame) and nested models in document order. `frame` is the model's own frame in the scope of
    its parent. If `static`, everything below it is static too, as in Gazebo.
    """

    name: str
    element: Element
    frame: Frame
    scope: FrameScope
    static: bool = False
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
    """Reads worlds and models; unusable elements are added to the report and left out."""

    def __init__(self, included_files: IncludedFiles, report: ImportReport) -> None:
        self._included_files, self._report = included_files, report
        self._model_count = 0

    def read_world(self, element: Element) -> ModelNode:
        """Read the models and actors of a `<world>`."""
        scope = FrameScope(WORLD_FRAME)
        world = ModelNode(element.name, element, Frame(WORLD_FRAME, element, None), scope)
        self._read_children(world, "world")
        return world

    def read_model(self, element: Element, static: bool, include: Element | None = None) -> ModelNode:
        """Read a model; `include` overrides name, pose, static and placement_frame as the specification allows."""
        self._model_count += 1
        if self._model_count > MAX_MODELS:
            raise element.unusable(f"more than {MAX_MODELS} models")
        overrides = {child.tag: child for child in include.children} if include else {}
        name = _name(element, overrides.get("name"))
        is_static = read_bool(overrides.get("static", element.child("static")))
        if include is not None and _is_merged(include):
            is_static = False
        scope = FrameScope(MODEL_FRAME)
        frame = Frame(name, element, overrides.get("pose", element.child("pose")), model_scope=scope)
        placement = overrides.get("placement_frame")
        frame.placement_frame = placement.text if placement else element.attributes.get("placement_frame", "")
        model = ModelNode(name, element, frame, scope, static or is_static)
        self._read_children(model, "model")
        scope.canonical = element.attributes.get("canonical_link", "") or scope.canonical
        return model

    def add_model(self, owner: ModelNode, model: ModelNode, merged: bool = False) -> None:
        """Nest a model in its owner; the frames of a merged model are visible in the owner."""
        owner.parts.append(model)
        name = f"_merged__{model.name}__model__" if merged else model.name
        owner.scope.frames.setdefault(name, model.frame)
        owner.scope.canonical = owner.scope.canonical or name
        if merged:
            owner.scope.merged_models.append(model.frame)

    def _read_children(self, owner: ModelNode, kind: str) -> None:
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
                self.add_model(owner, self.read_model(child, owner.static))
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
                scope.canonical = scope.canonical or frame.name
            case "world", "actor":
                owner.actors.append(self._read_actor(child))
            case "world", "population":
                raise child.unusable("<population> is not supported", "place its models one by one")
            case _:
                report_unknown(child, kind, self._report)

    def _read_actor(self, element: Element, include: Element | None = None) -> ModelNode:
        name = _name(element, include.child("name") if include else None)
        pose = (include.child("pose") if include else None) or element.child("pose")
        scope = FrameScope(MODEL_FRAME)
        actor = ModelNode(name, element, Frame(name, element, pose, model_scope=scope), scope)
        self._read_children(actor, "actor")
        return actor

    def _read_include(self, owner: ModelNode, include: Element) -> None:
        """Add the first model, actor or light of another file."""
        report_unknown_children(include, "include", self._report)
        root = self._included_files.enter(include)
        try:
            entities = list(root.all("model", "actor", "light", "world"))
            if not entities or entities[0].tag == "world":
                hint = "it contains a world" if entities else ""
                raise include.unusable(f"{root.source.name} contains no model", hint)
            if len(entities) > 1:
                self._report.note(root.place, "contains more than one model; only the first is included")
            first = entities[0]
            if first.tag == "model":
                self.add_model(owner, self.read_model(first, owner.static, include), _is_merged(include))
            elif first.tag == "actor":
                owner.actors.append(self._read_actor(first, include))
        finally:
            self._included_files.leave()


def _name(element: Element, override: Element | None) -> str:
    return checked_name(override, override.text) if override else checked_name(element)


def _is_merged(include: Element) -> bool:
    return parse_bool(include.attributes.get("merge", "0"), include)
