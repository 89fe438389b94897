"""Plain data of the simulated environment: world, map, costmap filters, scenery, pedestrians."""
