"""Rigid-body physics with PyBullet: the only part of simscen that knows an engine."""
