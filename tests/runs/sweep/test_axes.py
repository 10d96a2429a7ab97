"""Parameters that the axes of a sweep reach, and mistakes in them."""

from __future__ import annotations
