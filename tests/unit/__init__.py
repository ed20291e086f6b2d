"""Tests of single modules, without a store."""
