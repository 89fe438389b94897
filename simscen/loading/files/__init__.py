"""Find and load the files that commands and scenarios name: scenarios, worlds, maps, robots, and criteria."""
