"""Tests of the ArmarX bridge."""
