"""What the creep force moves: wheelset, drivetrain and track, and the force they can transmit."""
