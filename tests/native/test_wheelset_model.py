"""The wheelset's integrator."""

from __future__ import annotations
