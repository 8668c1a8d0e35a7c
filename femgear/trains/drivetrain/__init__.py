"""Drivetrain: bodies, bending shafts, gear stages and bearings, integrated in time."""
