"""Layered costmap of the robot (nav2_costmap_2d), vectorized."""
