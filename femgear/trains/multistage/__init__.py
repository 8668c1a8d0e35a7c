"""Planetary stages in series, rigid bodies with torsional and lateral couplings."""
