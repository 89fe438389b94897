"""A session of `simscen run`: selection of runs, execution, output files."""
