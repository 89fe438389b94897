"""Files that commands and scenarios name: scenarios, worlds, maps, robots, and criteria."""
