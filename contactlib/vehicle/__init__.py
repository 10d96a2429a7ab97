"""Wheelset, drivetrain and track, and the force they can transmit."""
