"""Measurements: recorded signals by turns, their spectra, and what their lines say about a gear set."""
