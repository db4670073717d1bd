"""What the tests of statics share."""

from case_fixtures import kept, read  # noqa: F401 - fixtures
