"""External navigation stacks: separate processes with which simscen exchanges frames of the stack protocol."""
