"""The kinds of readings, by name: what a light command may know of them."""

READINGS = ("Scan", "Odometry", "Imu", "Bump", "Image")
"""The classes of core.sensing."""
COMMAND = "Command"
"""The kind of cmd_vel, which faults can affect as they do readings."""
