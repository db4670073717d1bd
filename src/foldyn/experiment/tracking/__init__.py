"""Camera tracking: corners in films and photographs, and their assignment to a model's nodes."""
