"""The picture of a run, map.png: map, true and estimated path, plans, obstacles, events, and violations."""
