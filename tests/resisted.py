"""What the dampers of a case do at given displacements and velocities."""

from __future__ import annotations

import numpy as np

import foldyn as fd
from foldyn.dynamics.dampers import dampers
from foldyn.mechanics.term import FORCES, ThreadTerms, evaluate


def resisted(case: fd.Case, u: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, float]:
    """Forces (rows, 3), N, of the dampers alone, and the power (W) that they take."""
    body = case.elastic_body
    whole = body.with_terms(*dampers(case))
    model, first = ThreadTerms(whole, whole.thread_parts(1)[0], [FORCES]), len(body.terms)
    terms, force = model.terms, np.zeros((body.rows, 3))
    own = terms._replace(context=terms.context[first:], kernel=terms.kernel[first:])
    evaluate(own, u, v, force, np.zeros(0))
    return force, float(own.powers[1])
