"""Simulated sensors: lidar, wheel odometry, IMU, bumper, and camera, each with its own noise."""
