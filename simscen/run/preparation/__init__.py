"""Everything that the runs of a scenario share: world, map, robot, goals, and shortest paths."""
