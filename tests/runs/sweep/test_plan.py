"""Scenarios that a sweep makes."""

from __future__ import annotations
