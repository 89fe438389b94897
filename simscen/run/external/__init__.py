"""Run navigation stacks in processes of their own, with which simscen exchanges frames of the stack protocol."""
