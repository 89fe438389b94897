"""Geometry of solids: triangle meshes, upright prisms, cross sections, overlap tests."""
