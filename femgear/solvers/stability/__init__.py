"""Stability of motions: Floquet multipliers, charts of parametric stability, Lyapunov exponents."""
