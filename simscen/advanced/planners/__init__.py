"""Medial-axis planner, which Nav2 does not have: BIT* on samples of the medial axis of the free space."""
