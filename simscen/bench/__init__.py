"""Benchmarks of `simscen bench`: speed of the simulator, quality of navigation, and quality of localization."""
