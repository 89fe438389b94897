"""Files that scenarios and commands name: paths, kinds, worlds, maps, robots."""
