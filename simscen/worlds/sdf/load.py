"""Load an SDF file as a world: static solids, bodies, bounds and notes."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

import numpy as np

from simscen.core.environment.world_model import World
from simscen.core.geometry.meshes import FLOOR_HEIGHT_M
from simscen.core.geometry.shapes import Body, Solid
from simscen.worlds.extent import model_name, placed_solids, top_height, union
from simscen.worlds.geometry.prisms import bounding_rectangle
from simscen.worlds.maps.map_size import Bounds, map_size_error
from simscen.worlds.sdf.actors import read_actor
from simscen.worlds.sdf.bodies import split_model, with_unique_names
from simscen.worlds.sdf.elements import Element
from simscen.worlds.sdf.files import IncludedFiles, WorldFiles
from simscen.worlds.sdf.floors import could_be_floor, floor_height
from simscen.worlds.sdf.link_poses import ModelState, WorldState, place_links, read_state
from simscen.worlds.sdf.links import read_link
from simscen.worlds.sdf.model_tree import ModelNode, TreeReader
from simscen.worlds.sdf.report import ImportReport, UnusableElement
from simscen.worlds.sdf.shapes import ShapeReader

MAX_OUTLIER_FRACTION = 0.05
"""Maximum fraction of the models that `outliers` may leave out, in addition to one model."""

SolidOrBody = TypeVar("SolidOrBody", Solid, Body)


def load_sdf(path: Path, *, search: Sequence[Path] = (), root: Path, lenient: bool = False) -> World:
    """Load the world in a Gazebo `.sdf`, `.world` or model file of SDF 1.3 to 1.12.

    Only collision geometry is used. Static models become solids, other models bodies with their mass (0 if kinematic),
    and actors bodies of mass 0. A world whose floor is above z = 0 is lowered, because robots drive at z = 0. Files
    that the world refers to are searched for in its folder and in the folders `search`, and must be inside `root` or
    `search`.

    Raises InvalidInput for elements that affect the geometry but cannot be used. With `lenient`, such elements are left
    out with a note in `World.notes`, and InvalidInput is raised only if the file is unreadable or nothing is left.
    """
    report, files = ImportReport(lenient=lenient), WorldFiles.of([root, *search])
    try:
        world = _load_world(path, files, report)
    except UnusableElement as error:
        raise report.fatal_error(error) from error
    report.raise_problems()
    return world


def _load_world(path: Path, files: WorldFiles, report: ImportReport) -> World:
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
        report.note(other.location, f"only the first world of a file is loaded, which is {worlds[0].name!r}")
    if worlds:
        return worlds[0]
    if not any(document.all("model", "actor", "include")):
        raise document.unusable("contains neither a world nor a model")
    return document


class _WorldImporter:
    """Collects the solids and bodies of the models below `root`, the node of the world."""

    def __init__(self, root: ModelNode, shapes: ShapeReader, report: ImportReport) -> None:
        self._root, self._shapes, self._report = root, shapes, report
        self._solids: list[Solid] = []
        self._bodies: list[Body] = []

    def build(self, state: WorldState, tree: TreeReader) -> World:
        """Return the world after applying the saved `state`; `tree` reads the models that the state inserts."""
        for element in state.inserted_models:
            with self._report.skip_unusable():
                tree.add_model(self._root, tree.read_model(element, is_parent_static=False))
        for model in self._root.parts:
            if isinstance(model, ModelNode) and model.name not in state.deleted_names:
                with self._report.skip_unusable():
                    self._add_model(model, state)
        for actor in self._root.actors:
            with self._report.skip_unusable():
                body = read_actor(actor, self._root, self._shapes, self._report)
                self._bodies += [body] if body else []
        for joint in self._root.joints:
            self._report.note(joint.location, "a joint between models is ignored")
        return self._build_world()

    def _add_model(self, model: ModelNode, state: WorldState) -> None:
        """Collect the solids and bodies of a top-level model."""
        model_state = state.models.get(model.name, ModelState())
        pose = model_state.pose or self._root.scope.pose_of(model.frame)
        links = place_links(model, pose, self._report, model_state)
        contents = [read_link(link, self._shapes, self._report) for link in links]
        solids, bodies = split_model(model, pose, contents, self._report)
        self._solids += solids
        self._bodies += bodies

    def _build_world(self) -> World:
        """Return the world of the collected solids and bodies, without outliers and with its floor at z = 0."""
        element = self._root.element
        if not self._solids and not self._bodies and not self._report.has_problems:
            self._report_empty_world(element)
        name = element.name or Path(element.source.name).stem
        solids, bodies = self._without_outliers(with_unique_names(self._bodies, self._report, element))
        placed = placed_solids(solids, bodies)
        bounds = union(map(bounding_rectangle, placed))
        height = floor_height(placed, len(solids), bounds, self._shapes.has_ground)
        if height:
            self._report.note(
                element.location, f"its floor is {height:.3f} m above z = 0; the world is lowered by that height"
            )
        solids, bodies = _lower(solids, height), _lower(bodies, height)
        # Beside a floor that is above the ground plane, the ground is too low for robots.
        has_open_ground = self._shapes.has_ground and not height
        if map_size_error(bounds):
            raised = [solid for solid in placed if top_height(solid) > height + FLOOR_HEIGHT_M]
            has_open_ground = has_open_ground or len(raised) < len(placed)
            bounds = union(map(bounding_rectangle, raised))
        return World(name, solids, bodies, bounds=bounds, has_open_ground=has_open_ground, notes=self._report.notes)

    def _without_outliers(self, bodies: tuple[Body, ...]) -> tuple[tuple[Solid, ...], tuple[Body, ...]]:
        """Return the static solids and the bodies without outliers; see `outliers`. Floors are never outliers."""
        extents: dict[str, list[Bounds]] = {}
        for solid in self._solids:
            if not could_be_floor(solid):
                extents.setdefault(model_name(solid), []).append(bounding_rectangle(solid))
        for body in bodies:
            extents.setdefault(body.name, []).extend(bounding_rectangle(solid, body.pose) for solid in body.solids)
        far_models = outliers({name: union(boxes) for name, boxes in extents.items()})
        for name, distance in far_models.items():
            message = f"left out: {name!r} is {distance:.0f} m away from the median of all models, too far for a map"
            self._report.note(self._root.element.location, message)
        return (
            tuple(solid for solid in self._solids if model_name(solid) not in far_models),
            tuple(body for body in bodies if body.name not in far_models),
        )

    def _report_empty_world(self, element: Element) -> None:
        """Report that a world has no obstacles: as an error, or as a note if it has a ground plane.

        Raises UnusableElement if elements were skipped, because an empty world would then be misleading.
        """
        if self._report.skipped_count:
            message = f"nothing is left of this world: {self._report.skipped_count} of its elements were skipped"
            raise element.unusable(message, "load it without --lenient to see what is missing")
        if self._shapes.has_ground:
            self._report.note(element.location, "contains only a ground plane")
            return
        models = [m for part in self._root.parts if isinstance(part, ModelNode) for m in part.models()]
        has_links = any(not isinstance(part, ModelNode) for model in models for part in model.parts)
        reason = "it has no models"
        if models:
            reason = "its links have no collisions" if has_links else "its models have no links"
        message = f"no collision geometry in this world: {reason}"
        self._report.add_error(element.unusable(message, "load it with --lenient if the world should be empty"))


def _lower(items: Sequence[SolidOrBody], height: float) -> tuple[SolidOrBody, ...]:
    """Return solids or bodies moved down by `height` m."""
    return tuple(replace(item, pose=item.pose._replace(z=item.pose.z - height)) for item in items)


def outliers(extents: Mapping[str, Bounds]) -> dict[str, float]:
    """Return the models to leave out so that the others fit on a map, with their distances in m.

    Distances are from the median of the centers of all models. `extents` are the bounding rectangles of the models by
    name. The result is empty if all models fit, or if more than MAX_OUTLIER_FRACTION of the models (plus one) would
    have to be left out. It is also empty if an outlier overlaps the area of the other models, because such a model is
    large, but not far away.
    """
    names, corners = list(extents), np.array(list(extents.values())).reshape(-1, 2, 2)
    if not names:
        return {}
    centers = corners.mean(axis=1)
    distance = np.hypot(*(centers - np.median(centers, axis=0)).T)
    farthest_first = np.argsort(distance, kind="stable")[::-1]
    for count in range(min(int(MAX_OUTLIER_FRACTION * len(names)) + 2, len(names))):
        kept = corners[farthest_first[count:]]
        left, bottom = kept[:, 0].min(axis=0).tolist()
        right, top = kept[:, 1].max(axis=0).tolist()
        if map_size_error((left, bottom, right, top)) is None:
            left_out = corners[farthest_first[:count]]
            overlaps = ((left_out[:, 1] > (left, bottom)) & (left_out[:, 0] < (right, top))).all(axis=1)
            return {} if overlaps.any() else {names[k]: float(distance[k]) for k in farthest_first[:count]}
    return {}
