"""Benchmarks: speed of the simulator, quality of navigation and of localization."""
