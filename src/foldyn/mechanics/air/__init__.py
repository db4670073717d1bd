"""The fluid around a sheet: potential flow by doublets on boundary elements."""
