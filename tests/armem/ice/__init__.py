"""Tests of the Ice edge, with stand-in slice files of both generations."""
