"""VFH+ for simscen."""
