"""Contracts: for each kind of plug-in, a class whose methods check the rules of the protocol on one component."""
