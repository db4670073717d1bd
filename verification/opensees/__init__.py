"""The shell beside OpenSees."""
