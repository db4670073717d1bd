"""Reports: one self-contained HTML page of text, tables and pictures."""

from foldyn.facade import lazy

__getattr__, __dir__, __all__ = lazy(__name__, __file__)
