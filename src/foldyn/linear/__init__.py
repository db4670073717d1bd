"""Small vibrations about an equilibrium: modes and frequency response."""
