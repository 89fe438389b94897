"""Simulation of pedestrians: the social force model and reactions to robots. Imports only simscen.core."""
