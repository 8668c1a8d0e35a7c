"""Periodic and quasi-periodic motions: spectral iteration, harmonic balance, shooting."""
