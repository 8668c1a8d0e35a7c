"""Storage: results as xarray datasets, written whole or not at all."""
