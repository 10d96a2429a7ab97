"""Runs in time: one wheelset, one scenario, many at once, co-simulation, and their outcomes."""
