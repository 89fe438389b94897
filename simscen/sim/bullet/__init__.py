"""PyBullet clients, collision shapes and rigid bodies."""
