"""The report on all measurements, from the figures that they left."""
