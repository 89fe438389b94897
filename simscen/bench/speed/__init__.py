"""Speed benchmarks: CPU time per simulated second, compared with PyBullet without simscen."""
