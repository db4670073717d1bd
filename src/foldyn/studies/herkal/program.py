"""Which program computes the results of this study."""

from __future__ import annotations

from foldyn import program as computing

CASE_STUDIES = tuple(
    f"studies/herkal/{name}.py" for name in ("models", "runs", "metric", "partners", "sensitivity")
)
SPECIMEN = (
    "experiment", "studies/herkal/calibration.py", "studies/herkal/vibration.py",
    "studies/herkal/specimen", "studies/herkal/cases",
)  # fmt: skip


def program() -> str:
    """Digest of what computes the case studies."""
    return computing.program(*CASE_STUDIES)


def specimen_program() -> str:
    """Digest of what computes the specimen."""
    return computing.program(*SPECIMEN)
