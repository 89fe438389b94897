"""One contract for each kind of plug-in: a class whose methods check the rules of its protocol on a component."""
