"""Planners: paths on the global costmap, found by OMPL or by a grid search."""
