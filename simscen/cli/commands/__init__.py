"""The commands of `simscen`: one module each, imported when the command is called."""
