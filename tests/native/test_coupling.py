"""The force element coupled to a wheelset: held and implicit steps."""

from __future__ import annotations
