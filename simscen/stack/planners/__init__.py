"""Paths over the costmap, found by OMPL."""
