"""Numbers of which products and quotients of a few neither overflow nor vanish."""

from __future__ import annotations

from contactlib.parameters import Limits

REAL = Limits(at_least=-1e50, at_most=1e50)
POSITIVE = Limits(at_least=1e-50, at_most=1e50)
NOT_NEGATIVE = Limits(at_least=0.0, at_most=1e50)
