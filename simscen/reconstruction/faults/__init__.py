"""Estimators of faults: messages, lidar, odometry, gyroscope, commands, and localizer."""
