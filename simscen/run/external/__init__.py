"""External navigation stacks: separate processes that exchange frames (packets of the stack protocol) with simscen."""
