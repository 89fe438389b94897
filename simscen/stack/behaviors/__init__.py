"""What a robot does when it is stuck (nav2_behaviors)."""
