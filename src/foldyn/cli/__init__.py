"""The `foldyn` command."""
