"""What the tests of structures share."""

from case_fixtures import kept, read  # noqa: F401 - fixtures
