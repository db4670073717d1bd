"""All fuzzers; another one is a file with its target, and a line here."""

from __future__ import annotations

import fuzz_of_cases
import fuzz_of_drawings
import fuzz_of_fits
import fuzz_of_patterns
import fuzz_of_results
import fuzz_of_selections
import fuzz_of_tables
from fuzz_target import Target

TARGETS: dict[str, Target] = {
    target.name: target
    for target in (
        fuzz_of_cases.TARGET,
        *fuzz_of_drawings.TARGETS,
        fuzz_of_fits.TARGET,
        *fuzz_of_patterns.TARGETS,
        *fuzz_of_results.TARGETS,
        fuzz_of_selections.TARGET,
        fuzz_of_tables.TARGET,
    )
}
