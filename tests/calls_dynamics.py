"""Good calls of the dynamics: stability, control, torsion, traction, wheelsets, runs, sweeps."""

from __future__ import annotations

from hostile import Call

CALLS: list[Call] = []

# Public names without a call, and why.
EXEMPT: dict[str, str] = {}
