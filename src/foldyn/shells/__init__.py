"""Thin shells with creases: the finite element reference on the same patterns and sheets."""

from foldyn.shells.shell import Shell, ShellOptions, shell

__all__ = ["Shell", "ShellOptions", "shell"]
