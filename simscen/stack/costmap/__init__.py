"""Layered costmaps, as in nav2_costmap_2d."""
