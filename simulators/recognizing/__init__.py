"""Measurements of what recognition costs: rates, latency and memory."""
