"""How well bars and hinges match the shell: a set of cases, their reference, and the errors."""
