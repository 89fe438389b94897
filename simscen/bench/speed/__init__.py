"""Speed benchmarks: what a simulated second costs, held against PyBullet alone."""
