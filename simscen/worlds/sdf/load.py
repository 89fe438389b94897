"""From an SDF file to a world."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

import numpy as np

from simscen.core.environment.world_model import World
from simscen.core.geometry import Array
from simscen.core.geometry.shapes import Body, Solid
from simscen.worlds.geometry.prisms import plan_extents
from simscen.worlds.maps.map_size import Bounds
from simscen.worlds.sdf.actors import read_actor
from simscen.worlds.sdf.bodies import distinct, split
from simscen.worlds.sdf.files import Library
from simscen.worlds.sdf.includes import Shelf
from simscen.worlds.sdf.links import read_link
from simscen.worlds.sdf.markup import Element
from simscen.worlds.sdf.outliers import outliers
from simscen.worlds.sdf.placing import place
from simscen.worlds.sdf.planes import floor_height
from simscen.worlds.sdf.report import Report, Unusable
from simscen.worlds.sdf.shapes import ShapeReader
from simscen.worlds.sdf.state import ModelState, WorldState, read_state
from simscen.worlds.sdf.tree import Model, TreeReader


def load_sdf(path: Path, *, search: Sequence[Path] = (), root: Path, lenient: bool = False) -> World:
    """The world in a Gazebo `.sdf`, `.world` or model file of SDF 1.3 to 1.12.

    Only collision geometry counts. Static models become solids, others bodies with their mass; actors become bodies
    of mass 0 with a path. Everything is in the world's frame and in document order; a floor that lies above z = 0 is
    brought down to it, where robots drive. Files that it names are looked for
    beside it and in `search`, and must lie inside `root` or `search`.

    Raises InvalidInput with everything that would change the geometry and cannot be used; with `lenient` that is
    left out and told in the world's `notes`, and only a world file that cannot be read at all is an error.
    """
    report, library = Report(lenient=lenient), Library.of([root, *search])
    try:
        world = _read(path, library, report)
    except Unusable as error:
        raise report.fatal(error) from error
    report.raise_problems()
    return world


def _read(path: Path, library: Library, report: Report) -> World:
    shelf = Shelf(library, report)
    document = shelf.open_world(path)
    try:
        element = _top(document, report)
        tree = TreeReader(shelf, report)
        builder = _Builder(tree.world(element), ShapeReader(library, report), report)
        return builder.build(read_state(element, report), tree)
    except RecursionError as error:
        raise document.unusable("includes, models or frames are nested too deeply") from error


def _top(document: Element, report: Report) -> Element:
    """The element to load: the first world (as Gazebo does), otherwise the file itself with its models."""
    worlds = list(document.all("world"))
    for other in worlds[1:]:
        report.note(other.place, f"only the first world of a file is loaded, which is {worlds[0].name!r}")
    if worlds:
        return worlds[0]
    if not any(document.all("model", "actor", "include")):
        raise document.unusable("holds neither a world nor a model")
    return document


class _Builder:
    """Collects the solids and bodies of one world."""

    def __init__(self, whole: Model, shapes: ShapeReader, report: Report) -> None:
        self.whole, self.shapes, self.report = whole, shapes, report
        self.solids: list[Solid] = []
        self.bodies: list[Body] = []

    def build(self, state: WorldState, tree: TreeReader) -> World:
        """The world after the saved `state` was applied to it."""
        for element in state.inserted:
            with self.report.skipping():
                tree.nest(self.whole, tree.model(element, static=False))
        for model in self.whole.parts:
            if isinstance(model, Model) and model.name not in state.deleted:
                with self.report.skipping():
                    self._add(model, state)
        for actor in self.whole.actors:
            with self.report.skipping():
                body = read_actor(actor, self.whole, self.shapes, self.report)
                self.bodies += [body] if body else []
        for joint in self.whole.joints:
            self.report.note(joint.place, "a joint between models is ignored")
        return self._world()

    def _add(self, model: Model, state: WorldState) -> None:
        saved = state.models.get(model.name, ModelState())
        pose = saved.pose or self.whole.scope.place(model.frame)
        contents = [read_link(link, self.shapes, self.report) for link in place(model, pose, self.report, saved)]
        solids, bodies = split(model, pose, contents, self.report)
        self.solids += solids
        self.bodies += bodies

    def _world(self) -> World:
        element = self.whole.element
        if not self.solids and not self.bodies and not self.report.failed:
            self._refuse_emptiness(element)
        name = element.name or Path(element.source.name).stem
        solids, bodies, bounds = self._within_reach(distinct(self.bodies, self.report, element))
        height = floor_height(solids, bounds)
        if height:
            self.report.note(element.place, f"its floor lies {height:.3f} m high; the world is lowered by as much")
        solids, bodies = _lowered(solids, height), _lowered(bodies, height)
        return World(name, solids, bodies, bounds=bounds, notes=self.report.notes)

    def _within_reach(self, bodies: tuple[Body, ...]) -> tuple[tuple[Solid, ...], tuple[Body, ...], Bounds]:
        """The solids and bodies without those parked far away from all others, and the rectangle around them."""
        covered: dict[str, list[Array]] = {}
        for solid in self.solids:
            covered.setdefault(_model_of(solid), []).append(plan_extents(solid))
        for body in bodies:
            covered.setdefault(body.name, []).extend(plan_extents(solid, body.pose) for solid in body.solids)
        far = outliers({name: np.array(_around(corners)).reshape(2, 2) for name, corners in covered.items()})
        for name, distance in far.items():
            told = f"left out: {name!r} lies {distance:.0f} m away from the middle of all, too far for a map of them"
            self.report.note(self.whole.element.place, told)
        return (
            tuple(solid for solid in self.solids if _model_of(solid) not in far),
            tuple(body for body in bodies if body.name not in far),
            _around([corners for name, all_corners in covered.items() if name not in far for corners in all_corners]),
        )

    def _refuse_emptiness(self, element: Element) -> None:
        """Raise Unusable or report a world without obstacles, unless it is a ground plane on purpose."""
        if self.report.skipped:
            told = f"nothing is left of this world: {self.report.skipped} things in it were skipped"
            raise element.unusable(told, "load it without --lenient to see what is missing")
        if self.shapes.ground:
            self.report.note(element.place, "holds nothing but a ground plane")
            return
        self.report.unusable(element.unusable(self._why_empty(), "load it leniently if an empty floor is meant"))

    def _why_empty(self) -> str:
        models = [m for part in self.whole.parts if isinstance(part, Model) for m in part.models()]
        links = [part for model in models for part in model.parts if not isinstance(part, Model)]
        if not models:
            return "no collision geometry in this world: it has no models"
        if not links:
            return "no collision geometry in this world: its models have no links"
        return "no collision geometry in this world: its links have visuals at most"


def _model_of(solid: Solid) -> str:
    """The outermost model that a solid belongs to, by its scoped name."""
    return solid.name.partition("::")[0]


Placed = TypeVar("Placed", Solid, Body)


def _lowered(things: Sequence[Placed], height: float) -> tuple[Placed, ...]:
    return tuple(replace(thing, pose=thing.pose._replace(z=thing.pose.z - height)) for thing in things)


def _around(extents: list[Array]) -> Bounds:
    """The rectangle around rectangles (2, 2); zeros when there is none."""
    if not extents:
        return 0.0, 0.0, 0.0, 0.0
    low = np.min([corners[0] for corners in extents], axis=0)
    high = np.max([corners[1] for corners in extents], axis=0)
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])
