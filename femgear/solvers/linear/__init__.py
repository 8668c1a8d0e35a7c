"""Linear systems: modes, damping, receptances, modes over a parameter and the Campbell diagram."""
