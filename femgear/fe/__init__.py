"""Finite elements: grids of tooth sectors, elasticity, compliance of all flanks, and stepped shafts."""
