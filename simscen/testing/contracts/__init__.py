"""Contracts: a class for each kind of plug-in. Each of its methods checks one rule of the protocol on a component."""
