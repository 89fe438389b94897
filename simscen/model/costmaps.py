"""Specifications of the costmaps (nav2_costmap_2d), and of motion prediction, which adds moving obstacles to them."""

from typing import Annotated, Literal

from pydantic import Field

from simscen.spec.base import Ranged, Spec, by_default
from simscen.spec.quantities import (
    Frequency,
    Length,
    NonNegativeAngle,
    NonNegativeLength,
    PositiveAcceleration,
    PositiveLength,
    PositiveSpeed,
    Quantity,
)

ObstacleHeight = Annotated[Length, Field(ge=-100, le=100)]
PublishFrequency = Annotated[float, Field(ge=0, le=1000), Quantity("frequency")]


class DenoiseLayer(Spec):
    """Denoise layer of nav2_costmap_2d: removes obstacles of only a few cells."""

    enabled: bool = False
    """Whether to use the layer."""
    minimal_group_size: Annotated[int, Field(ge=1, le=1000)] = 2
    """Minimum number of cells of an obstacle; smaller groups are removed."""
    group_connectivity_type: Literal[4, 8] = 8
    """Connectivity of the cells of a group: 8 includes cells that touch at a corner, 4 does not."""


class Costmap(Ranged):
    """Global costmap in the map frame, for planning (nav2_costmap_2d: static, obstacle, and inflation layers)."""

    resolution: PositiveLength = 0.05
    """Maximum edge length of a cell. Larger cells of the map are split; smaller cells are kept."""
    inflation_radius: NonNegativeLength = 0.70
    """Distance from obstacles within which cells have a cost."""
    cost_scaling_factor: Annotated[float, Field(gt=0, le=100)] = 3.0
    """Rate of the exponential decay of the cost with the distance from an obstacle, per meter."""
    update_frequency: Frequency = 5.0
    """Rate of the updates with sensor data."""
    publish_frequency: PublishFrequency = 0.5
    """Maximum rate at which a changed costmap is written to the log. Large costmaps are written less often. 0 = never
    (Nav2: 1 Hz)."""
    lethal_cost_threshold: Annotated[int, Field(ge=1, le=100)] = 65
    """Minimum occupancy, in percent, of map cells that are obstacles (Nav2: 100). It has no effect on maps of the mode
    `trinary`, whose known cells have an occupancy of 0 or 100 %."""
    obstacle_max_range: PositiveLength = 2.5
    """Maximum distance at which obstacles are marked."""
    obstacle_min_range: NonNegativeLength = 0.0
    """Minimum distance at which obstacles are marked."""
    raytrace_max_range: PositiveLength = 3.0
    """Maximum distance up to which beams clear cells."""
    raytrace_min_range: NonNegativeLength = 0.0
    """Minimum distance from which beams clear cells."""
    min_obstacle_height: ObstacleHeight = 0.05
    """Minimum height of obstacles in camera data; lower points are ground. Lidar data is not filtered."""
    max_ground_slope: Annotated[NonNegativeAngle, Field(le=1)] = 0.2
    """Maximum slope of the ground in camera data between two successive points, going outward from the robot. Steeper
    rises are obstacles. With 0, as in Nav2, a ramp is an obstacle."""
    max_obstacle_height: NonNegativeLength = 2.0
    """Maximum height of obstacles in camera data; higher points are ignored."""
    inf_is_valid: bool = True
    """Whether beams without a hit clear the cells that they pass. In Nav2, such beams are ignored by default."""
    denoise_layer: DenoiseLayer = by_default()
    """Removal of small obstacles."""
    track_unknown_space: bool = True
    """Whether cells without information from the map or a sensor are unknown; otherwise such cells are free."""
    rolling_size: PositiveLength = 24.0
    """Edge length of the rolling window if the robot has no map."""


class LocalCostmap(Spec):
    """Local costmap for controllers and recovery behaviors: a rolling window in the odom frame.

    The local costmap contains sensor data and keepout zones, but not the map. Parameters without a default of their own
    have the values of the global costmap (`costmap`).
    """

    width: PositiveLength | None = None
    """Size along x of the odom frame; default: 3 m, or more if the controller looks farther ahead at full speed."""
    height: PositiveLength | None = None
    """Size along y of the odom frame; the default is the same as for `width`."""
    resolution: PositiveLength | None = None
    """Edge length of a cell."""
    inflation_radius: NonNegativeLength | None = None
    """Distance from obstacles within which cells have a cost."""
    cost_scaling_factor: Annotated[float, Field(gt=0, le=100)] | None = None
    """Rate of the exponential decay of the cost with the distance from an obstacle, per meter."""
    update_frequency: Frequency | None = None
    """Rate of the updates with sensor data."""
    publish_frequency: PublishFrequency = 1.0
    """Maximum rate at which the costmap is written to the log, if it has changed; 0 = never."""
    obstacle_max_range: PositiveLength | None = None
    """Maximum distance at which obstacles are marked."""
    obstacle_min_range: NonNegativeLength | None = None
    """Minimum distance at which obstacles are marked."""
    raytrace_max_range: PositiveLength | None = None
    """Maximum distance up to which beams clear cells."""
    raytrace_min_range: NonNegativeLength | None = None
    """Minimum distance from which beams clear cells."""
    min_obstacle_height: ObstacleHeight | None = None
    """Minimum height of obstacles in camera data; lower points are ground."""
    max_ground_slope: Annotated[NonNegativeAngle, Field(le=1)] | None = None
    """Maximum slope of the ground in camera data between two successive points, going outward from the robot."""
    max_obstacle_height: NonNegativeLength | None = None
    """Maximum height of obstacles in camera data; higher points are ignored."""
    inf_is_valid: bool | None = None
    """Whether beams without a hit clear the cells that they pass."""
    denoise_layer: DenoiseLayer | None = None
    """Removal of small obstacles."""
    track_unknown_space: bool = False
    """Whether cells that no beam has passed are unknown; otherwise they are free."""

    def with_defaults_from(self, global_costmap: Costmap) -> Costmap:
        """Return the parameters except `width` and `height`. Missing values are taken from the global costmap."""
        local = {name: getattr(self, name, None) for name in sorted(Costmap.model_fields)}
        return global_costmap.model_copy(update={name: value for name, value in local.items() if value is not None})


class Prediction(Ranged):
    """Motion prediction: tracks moving objects in the lidar scans, so that the robot avoids their future positions."""

    enabled: bool = False
    """Whether to predict motion."""
    max_range: PositiveLength = 12.0
    """Maximum distance of tracked objects."""
    max_radius: PositiveLength = 1.0
    """Maximum radius of tracked objects; larger ones are static."""
    min_speed: PositiveSpeed = 0.25
    """Minimum speed of tracked objects; slower ones are static."""
    acceleration: PositiveAcceleration = 1.5
    """Standard deviation of the acceleration of a tracked object."""
    margin: NonNegativeLength = 0.15
    """Distance from a tracked object within which scan points belong to it and are not marked in costmaps."""
