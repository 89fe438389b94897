"""What moves around the robot: tracked from scans, told to who plans, drives or brakes, and kept out of the way of."""
