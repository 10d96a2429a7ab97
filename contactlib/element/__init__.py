"""The force element: longitudinal creep force, and lateral force with spin."""
