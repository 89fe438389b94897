"""The commands of `simscen bench` and their output."""
