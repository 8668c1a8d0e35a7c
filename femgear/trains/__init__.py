"""Trains: what a case file may describe, each with its stages, results and figures."""
