"""Specification of maps in the format of Nav2's map_server."""

from typing import Annotated, Literal

from pydantic import ConfigDict, Field, ValidationInfo, field_validator

from simscen.spec.base import Spec
from simscen.spec.quantities import Length, PositiveLength, Probability


class RosMapSpec(Spec):
    """ROS map: an image and the meaning of its gray values (nav2_map_server, map_io.cpp, which ignores other keys)."""

    model_config = ConfigDict(extra="ignore")

    image: Annotated[str, Field(min_length=1, max_length=4096)]
    """Image file (pgm, png, bmp), relative to this file."""
    resolution: PositiveLength
    """Size of a pixel in meters."""
    origin: Annotated[list[Length], Field(min_length=3, max_length=3)]
    """Pose of the lower left corner of the lower left pixel: x, y, yaw."""
    negate: Literal[0, 1] | bool = 0
    """Whether black is free and white is occupied."""
    occupied_thresh: Probability = 0.65
    """Minimum darkness of occupied pixels."""
    free_thresh: Annotated[Probability, Field(validate_default=True)] = 0.25
    """Maximum darkness of free pixels."""
    mode: Literal["trinary", "scale", "raw"] = "trinary"
    """Interpretation of gray values between the thresholds."""

    @field_validator("free_thresh")
    @classmethod
    def _check_thresholds(cls, free: float, info: ValidationInfo) -> float:
        """Raise ValueError if a gray value could be both free and occupied."""
        occupied = info.data.get("occupied_thresh", 1.0)
        if free >= occupied:
            raise ValueError(f"free_thresh {free:g} must be less than occupied_thresh {occupied:g}")
        return free
