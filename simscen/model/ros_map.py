"""A map as Nav2's map_server reads it."""

from typing import Annotated, Literal

from pydantic import ConfigDict, Field, ValidationInfo, field_validator

from simscen.spec.base import Spec
from simscen.spec.quantities import Length, PositiveLength, Probability


class RosMapSpec(Spec):
    """A ROS map: an image and what its grays mean (nav2_map_server, map_io.cpp, which reads no other keys)."""

    model_config = ConfigDict(extra="ignore")

    image: Annotated[str, Field(min_length=1, max_length=4096)]
    """The image file (pgm, png, bmp), relative to this file."""
    resolution: PositiveLength
    """Meters for each pixel."""
    origin: Annotated[list[Length], Field(min_length=3, max_length=3)]
    """Pose of the lowest-left corner of the lowest-left pixel: x, y, yaw."""
    negate: Literal[0, 1] | bool = 0
    """Whether black is free and white is occupied."""
    occupied_thresh: Probability = 0.65
    """A pixel at least this dark is occupied."""
    free_thresh: Annotated[Probability, Field(validate_default=True)] = 0.25
    """A pixel at most this dark is free."""
    mode: Literal["trinary", "scale", "raw"] = "trinary"
    """How grays between the thresholds are read."""

    @field_validator("free_thresh")
    @classmethod
    def _below_occupied(cls, free: float, info: ValidationInfo) -> float:
        """Otherwise some grays were both free and occupied, and the order of the tests would decide."""
        occupied = info.data.get("occupied_thresh", 1.0)
        if free >= occupied:
            raise ValueError(f"free_thresh {free:g} must be less than occupied_thresh {occupied:g}")
        return free
