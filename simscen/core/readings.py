"""The kinds of readings, and of what else faults can affect, by name: what a light command may know of them."""

READINGS = ("Scan", "Odometry", "Imu", "Bump", "Image")
"""The classes of core.sensing."""
COMMAND = "Command"
"""The kind of cmd_vel: velocity commands on their way to the base."""
WHEELS = "Wheels"
"""The kind of wheels: what the motors make of a command, and what odometry counts of it."""
BELIEF = "Belief"
"""The kind of the localizer: where the navigator is told that the robot is."""
MAP = "Map"
"""The kind of the map that the stack is given."""
INSTANCES = {"cmd_vel": COMMAND, "wheels": WHEELS, "localizer": BELIEF, "map": MAP}
"""What faults affect besides sensors, by the name that scenarios have for it; a sensor of that name goes before."""
KINDS = (*READINGS, *INSTANCES.values())
"""All that `affects` of a fault may name."""
