"""Foundations for all packages: declared quantities, terminal text, atomic file writing."""
