"""stub"""

from typing import NamedTuple


class Expression(NamedTuple):
    measures: tuple

    def value_and_slopes(self, values):
        (n,) = self.measures
        return values[n], {n: 1.0}


def parse(text):
    return Expression((text,))
