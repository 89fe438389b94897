"""What the robot believes to be in its way: nav2_costmap_2d's layers, vectorized."""
