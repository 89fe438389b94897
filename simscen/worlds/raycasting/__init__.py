"""Ray casting with Embree: `mesh_scene` for one mesh, `ray_scene` for a world with moving and resting bodies."""
