"""Load an SDF file as a world: static solids, bodies, bounds and notes."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

import numpy as np

from simscen.core.environment.world_model import World
from simscen.core.geometry import Array
from simscen.core.geometry.shapes import Body, Solid
from simscen.worlds.geometry.prisms import mesh_bounds_2d
from simscen.worlds.maps.map_size import Bounds, map_size_error
from simscen.worlds.sdf.actors import read_actor
from simscen.worlds.sdf.bodies import read_link, split_model, with_unique_names
from simscen.worlds.sdf.elements import Element
from simscen.worlds.sdf.files import IncludedFiles, WorldFiles
from simscen.worlds.sdf.floors import floor_height
from simscen.worlds.sdf.link_poses import ModelState, WorldState, place_links, read_state
from simscen.worlds.sdf.model_tree import ModelNode, TreeReader
from simscen.worlds.sdf.report import ImportReport, UnusableElement
from simscen.worlds.sdf.shapes import ShapeReader

MAX_OUTLIER_SHARE = 0.05
"""Fraction of the models (rounded down, plus one) that may be outliers; with more, the world is regarded as large."""

Placed = TypeVar("Placed", Solid, Body)


def load_sdf(path: Path, *, search: Sequence[Path] = (), root: Path, lenient: bool = False) -> World:
    """Load the world in a Gazebo `.sdf`, `.world` or model file of SDF 1.3 to 1.12.

    Only collision geometry is used. Static models become solids, other models bodies with their mass, and actors
    bodies of mass 0 with a path. Poses are in the world frame, and the order is that of the document. A floor above
    z = 0 is lowered to z = 0, where robots drive. Files that the world refers to are searched in its folder and in
    `search`, and must lie inside `root` or `search`.

    Raises InvalidInput with all elements that would change the geometry and cannot be used. With `lenient`, such
    elements are left out with a note in `World.notes`, and only an unreadable world file is an error.
    """
    report, files = ImportReport(lenient=lenient), WorldFiles.of([root, *search])
    try:
        world = _load(path, files, report)
    except UnusableElement as error:
        raise report.fatal_error(error) from error
    report.raise_problems()
    return world


def _load(path: Path, files: WorldFiles, report: ImportReport) -> World:
    included_files = IncludedFiles(files, report)
    document = included_files.open_world(path)
    try:
        element = _world_element(document, report)
        tree = TreeReader(included_files, report)
        importer = _WorldImporter(tree.read_world(element), ShapeReader(files, report), report)
        return importer.build(read_state(element, report), tree)
    except RecursionError as error:
        raise document.unusable("includes, models or frames are nested too deeply") from error


def _world_element(document: Element, report: ImportReport) -> Element:
    """Return the first `<world>`, as Gazebo does, or the root of a file that contains only models."""
    worlds = list(document.all("world"))
    for other in worlds[1:]:
        report.note(other.place, f"only the first world of a file is loaded, which is {worlds[0].name!r}")
    if worlds:
        return worlds[0]
    if not any(document.all("model", "actor", "include")):
        raise document.unusable("contains neither a world nor a model")
    return document


class _WorldImporter:
    """Collects the solids and bodies of one world."""

    def __init__(self, root: ModelNode, shapes: ShapeReader, report: ImportReport) -> None:
        self._root, self._shapes, self._report = root, shapes, report
        self._solids: list[Solid] = []
        self._bodies: list[Body] = []

    def build(self, state: WorldState, tree: TreeReader) -> World:
        """Return the world with the saved `state` applied."""
        for element in state.inserted:
            with self._report.skip_unusable():
                tree.add_model(self._root, tree.read_model(element, static=False))
        for model in self._root.parts:
            if isinstance(model, ModelNode) and model.name not in state.deleted:
                with self._report.skip_unusable():
                    self._add_model(model, state)
        for actor in self._root.actors:
            with self._report.skip_unusable():
                body = read_actor(actor, self._root, self._shapes, self._report)
                self._bodies += [body] if body else []
        for joint in self._root.joints:
            self._report.note(joint.place, "a joint between models is ignored")
        return self._world()

    def _add_model(self, model: ModelNode, state: WorldState) -> None:
        saved = state.models.get(model.name, ModelState())
        pose = saved.pose or self._root.scope.pose_of(model.frame)
        links = place_links(model, pose, self._report, saved)
        contents = [read_link(link, self._shapes, self._report) for link in links]
        solids, bodies = split_model(model, pose, contents, self._report)
        self._solids += solids
        self._bodies += bodies

    def _world(self) -> World:
        element = self._root.element
        if not self._solids and not self._bodies and not self._report.has_problems:
            self._report_empty_world(element)
        name = element.name or Path(element.source.name).stem
        solids, bodies, bounds = self._without_outliers(with_unique_names(self._bodies, self._report, element))
        placed = [*solids, *(replace(s, pose=body.pose.compose(s.pose)) for body in bodies for s in body.solids)]
        height = floor_height(placed, bounds, self._shapes.has_ground)
        if height:
            self._report.note(
                element.place, f"its floor is {height:.3f} m above z = 0; the world is lowered by that height"
            )
        solids, bodies = _lowered_by(solids, height), _lowered_by(bodies, height)
        return World(name, solids, bodies, bounds=bounds, notes=self._report.notes)

    def _without_outliers(self, bodies: tuple[Body, ...]) -> tuple[tuple[Solid, ...], tuple[Body, ...], Bounds]:
        """Return the solids and bodies without those far away from all others, and the bounds of the rest."""
        extents: dict[str, list[Array]] = {}
        for solid in self._solids:
            extents.setdefault(_model_name(solid), []).append(mesh_bounds_2d(solid))
        for body in bodies:
            extents.setdefault(body.name, []).extend(mesh_bounds_2d(solid, body.pose) for solid in body.solids)
        far_models = outliers({name: np.array(_union(boxes)).reshape(2, 2) for name, boxes in extents.items()})
        for name, distance in far_models.items():
            message = f"left out: {name!r} is {distance:.0f} m away from the median of all models, too far for a map"
            self._report.note(self._root.element.place, message)
        return (
            tuple(solid for solid in self._solids if _model_name(solid) not in far_models),
            tuple(body for body in bodies if body.name not in far_models),
            _union([box for name, boxes in extents.items() if name not in far_models for box in boxes]),
        )

    def _report_empty_world(self, element: Element) -> None:
        """Report a world without obstacles as an error, unless it is a ground plane on purpose."""
        if self._report.skipped_count:
            message = f"nothing is left of this world: {self._report.skipped_count} of its elements were skipped"
            raise element.unusable(message, "load it without --lenient to see what is missing")
        if self._shapes.has_ground:
            self._report.note(element.place, "contains only a ground plane")
            return
        models = [m for part in self._root.parts if isinstance(part, ModelNode) for m in part.models()]
        has_links = any(not isinstance(part, ModelNode) for model in models for part in model.parts)
        reason = "it has no models"
        if models:
            reason = "its links have no collisions" if has_links else "its models have no links"
        message = f"no collision geometry in this world: {reason}"
        self._report.add_error(element.unusable(message, "load it with --lenient if the world should be empty"))


def _model_name(solid: Solid) -> str:
    """Return the name of the outermost model that a solid belongs to."""
    return solid.name.partition("::")[0]


def _lowered_by(placed: Sequence[Placed], height: float) -> tuple[Placed, ...]:
    return tuple(replace(each, pose=each.pose._replace(z=each.pose.z - height)) for each in placed)


def _union(boxes: list[Array]) -> Bounds:
    """Return the bounds of rectangles, each given by its corners (2, 2); zeros if there is none."""
    if not boxes:
        return 0.0, 0.0, 0.0, 0.0
    low = np.min([corners[0] for corners in boxes], axis=0)
    high = np.max([corners[1] for corners in boxes], axis=0)
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])


def outliers(extents: Mapping[str, Array]) -> dict[str, float]:
    """Return the models to leave out so that the others fit on a map, with their distances from the median in meters.

    `extents` are the corners (2, 2) of the rectangle around each model. The result is empty if all models fit, or if
    more than MAX_OUTLIER_SHARE of them would have to be left out.
    """
    names, corners = list(extents), np.array(list(extents.values())).reshape(-1, 2, 2)
    if not names:
        return {}
    centers = corners.mean(axis=1)
    distance = np.hypot(*(centers - np.median(centers, axis=0)).T)
    farthest_first = np.argsort(distance, kind="stable")[::-1]
    for count in range(min(int(MAX_OUTLIER_SHARE * len(names)) + 2, len(names))):
        kept = corners[farthest_first[count:]]
        left, bottom = kept[:, 0].min(axis=0).tolist()
        right, top = kept[:, 1].max(axis=0).tolist()
        if map_size_error((left, bottom, right, top)) is None:
            return {names[k]: float(distance[k]) for k in farthest_first[:count]}
    return {}
