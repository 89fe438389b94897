"""Everything that the robots of a simulation share: the world, the movable objects, and the current tick."""

from dataclasses import dataclass, field

from simscen.sim.objects.actors import Actors
from simscen.sim.scene.camera import RenderScene
from simscen.sim.scene.terrain import FloorFriction, Terrain
from simscen.sim.scene.walls import Walls


@dataclass(eq=False)
class Scene:
    """Engine client, static world, and movable objects, which all robots share. A tick is one physics step.

    `tick_rate` is in Hz. `render_scene` is None if the simulation has no images.
    """

    client: int
    tick_rate: int
    walls: Walls
    terrain: Terrain
    actors: Actors
    render_scene: RenderScene | None
    floor: FloorFriction = field(default_factory=FloorFriction)
    tick: int = 0
