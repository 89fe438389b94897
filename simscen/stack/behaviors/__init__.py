"""Recovery behaviors (nav2_behaviors)."""
