"""Results of a sweep: outcomes, failures, the report and the dataset."""

from __future__ import annotations
