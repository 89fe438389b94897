"""Finds faults in a recorded drive: of message streams, lidar, odometry, gyroscope, commands, and localizer."""
