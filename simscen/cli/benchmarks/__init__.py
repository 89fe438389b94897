"""Commands of `simscen bench` and their output."""
