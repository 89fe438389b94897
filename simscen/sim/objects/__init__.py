"""Movable objects other than robots (actors), such as doors and pedestrians: their motion and their collisions."""
