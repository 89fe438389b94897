"""The picture of a run, map.png: map, true and believed path, plans, obstacles, events, and violations."""
