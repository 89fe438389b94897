"""Commands of `simscen`: one module per command, which is imported only when the command is called."""
