"""The shell beside OpenSees: `stored` reads its results, `run` (with `opensees`) writes them."""
