"""How well bars and hinges match the shell: the cases, their references, and the errors."""
