"""The world as a tree of models, with every include replaced by what it names."""

from collections.abc import Iterator
from dataclasses import dataclass, field

from simscen.worlds.sdf import values
from simscen.worlds.sdf.frames import MODEL, WORLD, Frame, Scope
from simscen.worlds.sdf.includes import Shelf
from simscen.worlds.sdf.markup import Element
from simscen.worlds.sdf.report import Report
from simscen.worlds.sdf.vocabulary import judge_children, judge_unknown

MOST_MODELS = 20_000
"""Files that include each other tenfold at every level would otherwise unfold without end."""


@dataclass(eq=False)
class Model:
    """A model, or the world as the outermost one: `parts` are its links (Frame) and nested models in document order.

    `frame` is its own frame in its parent's scope. `static` counts for everything below it, as Gazebo has it.
    """

    name: str
    element: Element
    frame: Frame
    scope: Scope
    static: bool = False
    parts: "list[Frame | Model]" = field(default_factory=list)
    joints: list[Element] = field(default_factory=list)
    actors: "list[Model]" = field(default_factory=list)

    def models(self) -> "Iterator[Model]":
        """It and everything nested in it."""
        yield self
        for part in self.parts:
            if isinstance(part, Model):
                yield from part.models()


class TreeReader:
    """Reads worlds and models; what is unusable goes to the report and is left out."""

    def __init__(self, shelf: Shelf, report: Report) -> None:
        self.shelf, self.report = shelf, report
        self._count = 0

    def world(self, element: Element) -> Model:
        """The models and actors of a `<world>`."""
        world = Model(element.name, element, Frame(WORLD, element, None), Scope(WORLD))
        self._fill(world, "world", element.children)
        return world

    def _fill(self, owner: Model, kind: str, children: list[Element]) -> None:
        for child in children:
            with self.report.skipping():
                self._read(owner, kind, child)

    def _read(self, owner: Model, kind: str, child: Element) -> None:
        given, scope = child.child("pose"), owner.scope
        match kind, child.tag:
            case _, "frame":
                attached = child.attributes.get("attached_to", "")
                scope.add(Frame(values.name_of(child), child, given, attached, attached))
            case "world" | "model", "model":
                self.nest(owner, self.model(child, owner.static))
            case "world" | "model", "include":
                self.include(owner, child)
            case "world" | "model", "joint":
                owner.joints.append(child)
                moved = child.child("child")
                link = moved.text if moved else ""
                scope.add(Frame(values.name_of(child), child, given, link, link))
            case "model" | "actor", "link":
                frame = Frame(values.name_of(child), child, given)
                scope.add(frame)
                owner.parts.append(frame)
                scope.canonical = scope.canonical or frame.name
            case "world", "actor":
                owner.actors.append(self.actor(child))
            case "world", "population":
                raise child.unusable("<population> is not supported", "place its models one by one")
            case _:
                judge_unknown(child, kind, self.report)

    def nest(self, owner: Model, model: Model, merged: bool = False) -> None:
        """Put a model into its owner; merged ones lend it their names."""
        owner.parts.append(model)
        name = f"_merged__{model.name}__model__" if merged else model.name
        owner.scope.frames.setdefault(name, model.frame)
        owner.scope.canonical = owner.scope.canonical or name
        if merged:
            owner.scope.merged.append(model.frame)

    def model(self, element: Element, static: bool, include: Element | None = None) -> Model:
        """A model; `include` overrides name, pose, static and placement_frame as the specification allows."""
        self._count += 1
        if self._count > MOST_MODELS:
            raise element.unusable(f"more than {MOST_MODELS} models")
        over = {child.tag: child for child in include.children} if include else {}
        renamed, stilled, placed = over.get("name"), over.get("static"), over.get("placement_frame")
        name = values.name_of(renamed, renamed.text) if renamed else values.name_of(element)
        merged = include is not None and _merges(include)
        own_static = values.truth(stilled if stilled else element.child("static"))
        placement = placed.text if placed else element.attributes.get("placement_frame", "")
        scope = Scope(MODEL)
        frame = Frame(name, element, over.get("pose", element.child("pose")), inner=scope, placement=placement)
        model = Model(name, element, frame, scope, static or (own_static and not merged))
        self._fill(model, "model", element.children)
        scope.canonical = element.attributes.get("canonical_link", "") or scope.canonical
        return model

    def actor(self, element: Element, include: Element | None = None) -> Model:
        """An actor: a model whose motion is scripted."""
        renamed = include.child("name") if include else None
        name = values.name_of(renamed, renamed.text) if renamed else values.name_of(element)
        scope = Scope(MODEL)
        given = (include.child("pose") if include else None) or element.child("pose")
        actor = Model(name, element, Frame(name, element, given, inner=scope), scope)
        self._fill(actor, "actor", element.children)
        return actor

    def include(self, owner: Model, include: Element) -> None:
        """Bring in the one model, actor or light of another file."""
        judge_children(include, "include", self.report)
        root = self.shelf.enter(include)
        try:
            found = list(root.all("model", "actor", "light", "world"))
            if not found or found[0].tag == "world":
                raise include.unusable(f"{root.source.name} holds no model", "" if not found else "it holds a world")
            if len(found) > 1:
                self.report.note(root.place, "holds more than one model; an include brings the first")
            first = found[0]
            if first.tag == "model":
                self.nest(owner, self.model(first, owner.static, include), _merges(include))
            elif first.tag == "actor":
                owner.actors.append(self.actor(first, include))
        finally:
            self.shelf.leave()


def _merges(include: Element) -> bool:
    return values.truth_of(include.attributes.get("merge", "0"), include)
