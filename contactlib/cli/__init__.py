"""The command ``contactlib``."""
