"""Contracts: a class for each kind of plug-in. Each method marked with `promise` checks one rule of the protocol."""
