"""A planetary set with an elastic ring: modes, dynamics, run-up, and what a fixed sensor hears."""
