"""Directional derivatives of the models, and the dependencies that an FMU declares."""

from __future__ import annotations
