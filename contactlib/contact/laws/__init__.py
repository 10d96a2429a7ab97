"""Creep force laws, one module each: normalized creepage to traction ratio."""
