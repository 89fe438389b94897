"""The simulated environment as plain data: world, map, costmap filters, terrain, pedestrians."""
