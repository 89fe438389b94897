"""Ray casting with Embree."""
