"""The paper's specimen: from photographs and a film to a calibrated model."""
