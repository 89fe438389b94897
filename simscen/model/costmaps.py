"""The parameters of the two costmaps (nav2_costmap_2d)."""

from typing import Annotated, Literal

from pydantic import Field

from simscen.spec.base import Ranged, Spec, by_default
from simscen.spec.quantities import (
    Frequency,
    NonNegativeAngle,
    NonNegativeLength,
    PositiveLength,
)


class DenoiseLayer(Spec):
    """nav2_costmap_2d's denoise layer: obstacles of very few cells are noise, and left out."""

    enabled: bool = False
    """Whether it is there at all."""
    minimal_group_size: Annotated[int, Field(ge=1, le=1000)] = 2
    """Groups of fewer cells are left out."""
    group_connectivity_type: Literal[4, 8] = 8
    """Whether cells that touch at a corner are of one group: 8, or 4 where only edges join."""


class Costmap(Ranged):
    """The global costmap (nav2_costmap_2d: static, obstacle and inflation layers), in the map frame, for plans."""

    resolution: PositiveLength = 0.05
    """Edge of the largest cell: those of a coarser map are split, those of a finer one stay as they are."""
    inflation_radius: NonNegativeLength = 0.70
    """How far around obstacles cells cost something."""
    cost_scaling_factor: Annotated[float, Field(gt=0, le=100)] = 3.0
    """How fast cost falls with the distance to an obstacle, for each meter."""
    update_frequency: Frequency = 5.0
    """How often what the lidars see is taken in."""
    obstacle_max_range: PositiveLength = 2.5
    """What is seen further off is not marked."""
    obstacle_min_range: NonNegativeLength = 0.0
    """What is seen nearer is not marked."""
    raytrace_max_range: PositiveLength = 3.0
    """Beams clear cells up to this distance."""
    raytrace_min_range: NonNegativeLength = 0.0
    """Beams clear cells from this distance on."""
    min_obstacle_height: NonNegativeLength = 0.05
    """Of what a camera sees, lower things are the ground. Lidars see at their own height, whatever this says."""
    max_ground_slope: Annotated[NonNegativeAngle, Field(le=1)] = 0.2
    """What a camera sees to rise from the robot's feet on no steeper than this is the ground; 0: heights are above the
    plane on which the robot stands, and a ramp is an obstacle, as in Nav2."""
    max_obstacle_height: NonNegativeLength = 2.0
    """Of what a camera sees, higher things are not in the way."""
    inf_is_valid: bool = True
    """Whether beams that meet nothing clear what they pass through. Nav2's default is that they say nothing."""
    denoise_layer: DenoiseLayer = by_default()
    """What is done about single cells."""
    track_unknown_space: bool = True
    """Whether what the map does not know, and no beam has passed through, is unknown; else it is free."""
    rolling_size: PositiveLength = 24.0
    """Edge of the rolling window when driving without a map."""


class LocalCostmap(Spec):
    """The local costmap, which rolls with the robot in the odom frame, for controllers and behaviors.

    It shows what the sensors see and keepout zones, and no map. What is not said here is as in `costmap`.
    """

    width: PositiveLength | None = None
    """Along x of the odom frame; default: what the controller looks ahead at full speed, at least 3 m."""
    height: PositiveLength | None = None
    """Along y of the odom frame; default: as for the width."""
    resolution: PositiveLength | None = None
    """Edge of a cell."""
    inflation_radius: NonNegativeLength | None = None
    """How far around obstacles cells cost something."""
    cost_scaling_factor: Annotated[float, Field(gt=0, le=100)] | None = None
    """How fast cost falls with the distance to an obstacle, for each meter."""
    update_frequency: Frequency | None = None
    """How often what the sensors see is taken in."""
    obstacle_max_range: PositiveLength | None = None
    """What is seen further off is not marked."""
    obstacle_min_range: NonNegativeLength | None = None
    """What is seen nearer is not marked."""
    raytrace_max_range: PositiveLength | None = None
    """Beams clear cells up to this distance."""
    raytrace_min_range: NonNegativeLength | None = None
    """Beams clear cells from this distance on."""
    min_obstacle_height: NonNegativeLength | None = None
    """Of what a camera sees, lower things are the ground."""
    max_ground_slope: Annotated[NonNegativeAngle, Field(le=1)] | None = None
    """What a camera sees to rise no steeper than this is the ground."""
    max_obstacle_height: NonNegativeLength | None = None
    """Of what a camera sees, higher things are not in the way."""
    inf_is_valid: bool | None = None
    """Whether beams that meet nothing clear what they pass through."""
    denoise_layer: DenoiseLayer | None = None
    """What is done about single cells."""
    track_unknown_space: bool = False
    """Whether what no beam has passed through is unknown; else it is free."""

    def completed(self, shared: Costmap) -> Costmap:
        """The costmap with what it does not say itself from `shared`."""
        own = {name: value for name in sorted(Costmap.model_fields) if (value := getattr(self, name, None)) is not None}
        return shared.model_copy(update=own)
