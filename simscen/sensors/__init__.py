"""Simulated sensors: lidar, wheel odometry, and IMU with noise, and bumper and camera without noise."""
