"""Branches of solutions over a parameter, past limit points and branch points."""
