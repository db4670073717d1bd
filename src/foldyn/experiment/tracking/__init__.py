"""Camera tracking: corners in films and photographs, and which node of a model each of them is."""
