"""System: matrices, force laws and mesh stiffnesses of the dynamic problem that the solvers take."""
