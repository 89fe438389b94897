"""Read the tree of models in a world. An `<include>` is replaced by the model that it refers to."""

from collections.abc import Iterator
from dataclasses import dataclass, field

from simscen.worlds.sdf.elements import Element, checked_name, parse_bool, read_bool
from simscen.worlds.sdf.files import IncludedFiles
from simscen.worlds.sdf.frames import MODEL_FRAME, WORLD_FRAME, Frame, FrameScope
from simscen.worlds.sdf.known_elements import report_unknown, report_unknown_children
from simscen.worlds.sdf.report import ImportReport

MAX_MODELS = 20_000
"""Maximum number of models, because files that include each other can multiply models."""


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
        """Add a child element to the node `owner`; see `_read_children`. Raises UnusableElement."""
        pose, scope = child.child("pose"), owner.scope
        match kind, child.tag:
            case _, "frame":
                scope.add(Frame(checked_name(child), child, pose, child.attributes.get("attached_to", "")))
            case "world" | "model", "model":
                self.add_model(owner, self.read_model(child, owner.is_static))
            case "world" | "model", "include":
                self._read_include(owner, child)
            case "world" | "model", "joint":
                owner.joints.append(child)
                child_link = child.child("child")
                scope.add(Frame(checked_name(child), child, pose, child_link.text if child_link else ""))
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
        with self._included_files.open_include(include) as root:
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


def _checked_name(element: Element, override: Element | None) -> str:
    """Return the text of the element `override` if given, otherwise the name of `element`."""
    return checked_name(override, override.text) if override else checked_name(element)


def _has_merge(include: Element) -> bool:
    return parse_bool(include.attributes.get("merge", "0"), include)
