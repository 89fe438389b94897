"""Planners, which find paths on the global costmap with OMPL or a grid search."""
