"""Helical planetary set of rigid bodies with six motions each."""
