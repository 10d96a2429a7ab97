"""Relaxation of the contact over a step."""

from __future__ import annotations
