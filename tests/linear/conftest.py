"""What the tests of vibrations share."""

from case_fixtures import kept, read  # noqa: F401 - fixtures
